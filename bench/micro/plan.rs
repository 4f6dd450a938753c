//! One plan of every method, under way and with its plan made, by neighbours and obstacles in sight. What planning ahead
//! takes, and the slowest plans, are in `shoal bench planners`.

use crate::route::{Cell, MEASURED, Route, WARM_UP};
use divan::Bencher;
use shoal::verbs::bench::planners::course::with_defaults;
use std::hint::black_box;

const PLANS: u32 = 16;

/// Rows are named `method neighbours+obstacles`.
#[divan::bench(args = Cell::all(|_| true), sample_size = PLANS, sample_count = MEASURED as u32 / PLANS)]
fn plan(bencher: Bencher<'_, '_>, cell: &Cell) {
    let route = Route::new(cell);
    let mut planner = with_defaults(cell.method);
    (0..WARM_UP).for_each(|tick| _ = planner.plan(&route.input(tick)));
    let mut ticks = (WARM_UP..WARM_UP + MEASURED).cycle();
    bencher
        .with_inputs(|| ticks.next().expect("it goes round"))
        .bench_local_values(|tick| planner.plan(black_box(&route.input(tick))));
}
