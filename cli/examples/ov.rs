fn main() {
    let d = "/work/shared/data/sky64/";
    let r = |n: &str| {
        dust3d::io::MapSource::parse(format!("{d}{n}.f64"))
            .unwrap()
            .read()
            .unwrap()
            .values
    };
    let (i, q, u, t, b) = (r("I_353"), r("Q_353"), r("U_353"), r("T"), r("beta"));
    let png = dust3d::plot::overview::render(&dust3d::plot::Overview {
        nside: 64,
        i: &i,
        q: &q,
        u: &u,
        t: &t,
        beta: &b,
    })
    .unwrap();
    std::fs::write("/tmp/pics/ov.png", png).unwrap();
}
