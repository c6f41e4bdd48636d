//! Pictures: valid PNGs of the size asked for, with the right colours in the right places.

use crate::shell::Shell;
use dust3d::plot::{Overview, overview};
use std::io::Cursor;

struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    fn decode(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(Cursor::new(bytes))
            .read_info()
            .expect("a PNG");
        let mut rgb = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut rgb).expect("a frame");
        assert_eq!(
            (info.color_type, info.bit_depth),
            (png::ColorType::Rgb, png::BitDepth::Eight)
        );
        Self {
            width: info.width as usize,
            height: info.height as usize,
            rgb,
        }
    }

    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let index = 3 * (y * self.width + x);
        [self.rgb[index], self.rgb[index + 1], self.rgb[index + 2]]
    }

    fn count(&self, wanted: impl Fn([u8; 3]) -> bool) -> usize {
        self.rgb
            .as_chunks::<3>()
            .0
            .iter()
            .filter(|pixel| wanted(**pixel))
            .count()
    }
}

const fn is_red([r, g, b]: [u8; 3]) -> bool {
    r > 90 && g < 40 && b < 40
}

const fn is_blue([r, g, b]: [u8; 3]) -> bool {
    r < 40 && g < 60 && b > 150
}

const fn is_grey([r, g, b]: [u8; 3]) -> bool {
    r == 178 && g == 178 && b == 178
}

/// North 1, south -1, the quarter around the south pole missing.
fn halves() -> Vec<f64> {
    (0..768)
        .map(|p| match p {
            0..384 => 1.0,
            384..640 => -1.0,
            _ => f64::NAN,
        })
        .collect()
}

#[test]
fn mollweide_shows_north_above() {
    let shell = Shell::new();
    shell.write_f64("a.f64", &halves());
    for scale in ["linear", "symlog"] {
        shell.succeed(&[
            "map", "plot", "a.f64", "--scale", scale, "--unit", "K", "--title", "halves", "--out",
            "a.png",
        ]);
        let picture = Picture::decode(&shell.read("a.png"));
        assert_eq!(picture.width, 1200);
        assert!((600..800).contains(&picture.height), "{}", picture.height);
        let all = picture.width * picture.height;
        assert!(
            picture.count(is_red) > all / 5
                && picture.count(is_blue) > all / 10
                && picture.count(is_grey) > all / 20
        );
        // On a meridian that is none of the graticule's, from the pole down: red, blue, grey.
        let column: Vec<[u8; 3]> = (0..picture.height).map(|y| picture.at(645, y)).collect();
        let first = |wanted: fn([u8; 3]) -> bool| {
            column
                .iter()
                .position(|pixel| wanted(*pixel))
                .expect("seen")
        };
        let (red, blue, grey) = (first(is_red), first(is_blue), first(is_grey));
        assert!(
            red < 100 && red < blue && blue < grey,
            "{red} {blue} {grey}"
        );
        // Paper in the corners.
        for (x, y) in [(0, 0), (1199, 0), (0, picture.height - 1), (20, 120)] {
            assert_eq!(picture.at(x, y), [255; 3]);
        }
        // Words above the map and numbers below it.
        assert!(
            (0..50).any(|y| (400..800).any(|x| picture.at(x, y)[0] < 60)),
            "no title"
        );
        assert!(
            (picture.height - 70..picture.height)
                .any(|y| picture.at(600, y)[0] < 90 || picture.at(597, y)[0] < 90)
        );
    }
}

#[test]
fn longitude_increases_to_the_left() {
    let shell = Shell::new();
    // Only l from 45° to 135° is bright: pixels on the equatorial rings of Nside 8, 32 to a ring.
    let values: Vec<f64> = (0..768)
        .map(|p| f64::from(u8::from((p - 112) % 32 >= 4 && (p - 112) % 32 < 12)))
        .collect();
    shell.write_f64("a.f64", &values);
    shell.succeed(&[
        "map", "plot", "a.f64", "--out", "a.png", "--min", "0", "--max", "1", "--width", "600",
    ]);
    let picture = Picture::decode(&shell.read("a.png"));
    assert_eq!(picture.width, 600);
    let middle = picture.height * 46 / 100 - 9;
    assert!(is_red(picture.at(155, middle)) && is_blue(picture.at(445, middle)));
}

#[test]
fn gnomonic_detail_is_where_one_asks() {
    let shell = Shell::new();
    shell.write_f64("a.f64", &halves());
    let args = [
        "map",
        "plot",
        "a.f64",
        "--gnomonic",
        "30,0",
        "--side",
        "40",
        "--min",
        "-1",
        "--max",
        "1",
        "--out",
        "g.png",
    ];
    shell.succeed(&args);
    let picture = Picture::decode(&shell.read("g.png"));
    assert_eq!(picture.width, 1200);
    assert!(
        picture.height > 1200 && is_red(picture.at(560, 300)) && is_blue(picture.at(560, 1000))
    );
    let args = [
        "map",
        "plot",
        "a.f64",
        "--gnomonic",
        "0,-90",
        "--side",
        "10",
        "--min",
        "-1",
        "--max",
        "1",
        "--out",
        "p.png",
    ];
    shell.succeed(&args);
    assert!(is_grey(Picture::decode(&shell.read("p.png")).at(560, 300)));
}

#[test]
fn pictures_are_reproducible() {
    let shell = Shell::new();
    shell.write_f64("a.f64", &halves());
    for (name, threads) in [("a.png", "1"), ("b.png", "2")] {
        shell.succeed(&[
            "map",
            "plot",
            "a.f64",
            "--title",
            "t",
            "--threads",
            threads,
            "--out",
            name,
        ]);
    }
    assert_eq!(shell.read("a.png"), shell.read("b.png"));
}

#[test]
fn odd_maps_have_pictures_too() {
    let shell = Shell::new();
    shell.write_f64("missing.f64", &[f64::NAN; 12]);
    shell.write_f64("zero.f64", &[0.0; 12]);
    shell.write_f64("constant.f64", &[-3e-12; 12]);
    for name in ["missing", "zero", "constant"] {
        for scale in ["linear", "symlog"] {
            let (map, out) = (format!("{name}.f64"), format!("{name}_{scale}.png"));
            shell.succeed(&[
                "map", "plot", &map, "--scale", scale, "--out", &out, "--width", "300",
            ]);
            Picture::decode(&shell.read(&out));
        }
    }
}

#[test]
fn plot_refuses_what_it_cannot_show() {
    let shell = Shell::new();
    shell.write_f64("a.f64", &halves());
    for (extra, part) in [
        (&["--min", "1", "--max", "1"][..], "from 1 to 1"),
        (&["--width", "10"], "10 pixels"),
        (&["--gnomonic", "0,95"], "latitude"),
        (&["--gnomonic", "0,0", "--side", "180"], "180"),
        (&["--gnomonic", "north"], "two angles"),
        (&["--scale", "symlog", "--threshold", "0"], "threshold"),
    ] {
        let mut args = vec!["map", "plot", "a.f64", "--out", "a.png"];
        args.extend(extra);
        let message = shell.fail(2, &args);
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn overview_holds_five_maps() {
    let map = halves();
    let mut t = vec![19.0; 768];
    t[100] = 21.0;
    let maps = Overview {
        nside: 8,
        grid: 8,
        i: &t,
        q: &map,
        u: &map,
        t: &t,
        beta: &t,
    };
    let picture = Picture::decode(&overview::render(&maps).expect("a picture"));
    assert_eq!(picture.width, 1800);
    // Q and U side by side: as much grey on the left as on the right.
    let grey = |range: std::ops::Range<usize>| {
        range
            .flat_map(|x| (0..picture.height).map(move |y| (x, y)))
            .filter(|(x, y)| is_grey(picture.at(*x, *y)))
            .count()
    };
    let (left, right) = (grey(0..900), grey(900..1800));
    assert!(
        left > 10_000 && left.abs_diff(right) < left / 100,
        "{left} {right}"
    );
    let short = Overview {
        u: &map[..767],
        ..maps
    };
    assert!(overview::render(&short).is_err());
}
