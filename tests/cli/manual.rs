//! `completions` and `man`.

use crate::shell::Shell;

#[test]
fn completions_of_every_shell() {
    let shell = Shell::new();
    for (name, part) in [
        ("bash", "complete -F"),
        ("zsh", "#compdef dust3d"),
        ("fish", "complete -c dust3d"),
        ("elvish", "edit:completion"),
        ("powershell", "Register-ArgumentCompleter"),
    ] {
        let text = shell.succeed(&["completions", name]);
        for part in [part, "seed-names", "synthesise"] {
            assert!(text.contains(part), "{name}: {part}");
        }
    }
    assert!(
        shell
            .succeed(&["completions", "zsh"])
            .contains("demo paper planck-gnilc")
    );
    assert!(shell.fail(2, &["completions", "tcsh"]).contains("tcsh"));
}

#[test]
fn a_page_for_every_command() {
    let shell = Shell::new();
    let top = shell.succeed(&["man"]);
    assert!(
        top.contains(".TH DUST3D 1") && top.contains("dust3d\\-emit(1)"),
        "{top}"
    );
    let emit = shell.succeed(&["man", "emit"]);
    assert!(emit.contains("dust3d\\-emit") && emit.contains("\\-\\-seed\\-names"));
    shell.succeed(&["man", "--out", "man1"]);
    for page in [
        "dust3d",
        "dust3d-run",
        "dust3d-emit",
        "dust3d-export",
        "dust3d-map-plot",
    ] {
        assert!(!shell.read(&format!("man1/{page}.1")).is_empty());
    }
    assert_eq!(shell.read("man1/dust3d-emit.1"), emit.as_bytes());
    assert!(shell.fail(2, &["man", "--out", "man1"]).contains("--force"));
    shell.succeed(&["man", "--out", "man1", "--force"]);
    assert!(
        shell
            .fail(2, &["man", "map", "nothing"])
            .contains("map nothing")
    );
}
