//! What holds for every paper, whatever is in it.

use shoal_reproduce::row::Form;
use shoal_reproduce::{PAPERS, Rows};
use std::collections::BTreeSet;
use std::ops::ControlFlow;

#[test]
fn figures_have_data() {
    for paper in PAPERS {
        let series = (paper.series)();
        for series in &series {
            assert!(!series.lines.is_empty(), "{}", series.name);
            for (name, points) in &series.lines {
                assert!(!points.is_empty(), "{}: {name}", series.name);
                assert!(points.iter().flatten().all(|x| x.is_finite()), "{}: {name}", series.name);
                if series.form == Form::Surface {
                    assert!(name.parse::<f64>().is_ok() && points.len() == series.lines[0].1.len(), "{}", series.name);
                }
            }
        }
        let names: BTreeSet<&str> = series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names.len(), series.len(), "{}: names are different", paper.name);
    }
}

#[test]
fn a_break_is_obeyed() {
    for paper in PAPERS {
        let mut left = 3;
        let mut stop = |_: &str| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut rows = Rows::new(paper.name, &mut stop);
        assert!((paper.rows)(&mut rows).is_break(), "{}", paper.name);
        assert!(!rows.finish().is_empty(), "{}", paper.name);
    }
}
