//! Who is near whom: bodies sorted into the cells of a uniform grid, rebuilt when a tick opens.

use crate::body::Body;
use model::RobotIndex;
use nalgebra::{Point2, Vector2};

/// An axis-parallel rectangle, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aabb {
    pub(crate) low: Point2<f64>,
    pub(crate) high: Point2<f64>,
}

impl Aabb {
    /// The smallest that holds these points; with no points it holds nothing.
    pub(crate) fn around(points: impl IntoIterator<Item = Point2<f64>>) -> Aabb {
        let nothing =
            Aabb { low: Point2::new(f64::INFINITY, f64::INFINITY), high: Point2::new(-f64::INFINITY, -f64::INFINITY) };
        points.into_iter().fold(nothing, |all, p| Aabb { low: all.low.inf(&p), high: all.high.sup(&p) })
    }

    pub(crate) fn grown(self, by: f64) -> Aabb {
        let by = Vector2::new(by, by);
        Aabb { low: self.low - by, high: self.high + by }
    }

    pub(crate) fn moved(self, offset: Vector2<f64>) -> Aabb {
        Aabb { low: self.low + offset, high: self.high + offset }
    }

    pub(crate) fn contains(&self, p: Point2<f64>) -> bool {
        p.x >= self.low.x && p.x <= self.high.x && p.y >= self.low.y && p.y <= self.high.y
    }

    /// Whether the two have a point in common.
    pub(crate) fn meets(&self, other: &Aabb) -> bool {
        self.low.x <= other.high.x
            && other.low.x <= self.high.x
            && self.low.y <= other.high.y
            && other.low.y <= self.high.y
    }
}

/// A body in the grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    pub(crate) robot: RobotIndex,
    pub(crate) position: Point2<f64>,
}

/// Bodies by cell. A few cells per body, whatever the extent, so that a rebuild is linear and a query for everything
/// costs little more than a list.
#[derive(Default)]
pub(crate) struct Grid {
    origin: Point2<f64>,
    per_m: f64,
    columns: usize,
    rows: usize,
    /// Where the items of a cell begin; row by row, so that the cells of one row are one slice.
    begins: Vec<u32>,
    items: Vec<Item>,
    cells: Vec<u32>,
}

impl Grid {
    /// Sorts in the bodies that are in the world, where they are now.
    pub(crate) fn rebuild(&mut self, bodies: &[Body]) {
        const CELLS_PER_BODY: f64 = 4.0;
        const CELLS_PER_SIDE_MAX: f64 = 128.0;
        let present = || bodies.iter().filter(|body| body.in_world);
        let (count, extent) = (present().count(), Aabb::around(present().map(|body| body.pose.position)));
        let size = if count > 0 { extent.high - extent.low } else { Vector2::zeros() };
        let area_m2 = size.x * size.y / (CELLS_PER_BODY * count.max(1) as f64);
        let cell_m = area_m2.sqrt().max(size.max() / CELLS_PER_SIDE_MAX).max(1e-6);
        self.origin = if count > 0 { extent.low } else { Point2::origin() };
        self.per_m = 1.0 / cell_m;
        self.columns = (size.x * self.per_m) as usize + 1;
        self.rows = (size.y * self.per_m) as usize + 1;

        self.begins.clear();
        self.begins.resize(self.columns * self.rows + 1, 0);
        self.cells.clear();
        for body in present() {
            let cell = self.row(body.pose.position.y) * self.columns + self.column(body.pose.position.x);
            self.cells.push(cell as u32);
            self.begins[cell] += 1;
        }
        let mut end = 0;
        for begin in &mut self.begins {
            end += *begin;
            *begin = end;
        }
        // Filling every cell from its end, in falling order of slots, leaves its begin, and its slots sorted.
        self.items.clear();
        self.items.resize(count, Item { robot: RobotIndex(0), position: Point2::origin() });
        for (body, cell) in bodies.iter().rev().filter(|body| body.in_world).zip(self.cells.iter().rev()) {
            let begin = &mut self.begins[*cell as usize];
            *begin -= 1;
            self.items[*begin as usize] = Item { robot: body.instance.index, position: body.pose.position };
        }
    }

    /// All bodies in the cells that the rectangle touches: every one inside it, and some around. The rectangle may
    /// be infinite.
    pub(crate) fn visit(&self, area: Aabb, mut visitor: impl FnMut(Item)) {
        if self.items.is_empty() {
            return;
        }
        let (left, right) = (self.column(area.low.x), self.column(area.high.x));
        for row in self.row(area.low.y)..=self.row(area.high.y) {
            let begin = self.begins[row * self.columns + left] as usize;
            let end = self.begins[row * self.columns + right + 1] as usize;
            self.items[begin..end].iter().for_each(|item| visitor(*item));
        }
    }

    // Casts to integers saturate, so that infinities and what lies outside end up in the outermost cells.
    fn column(&self, x: f64) -> usize {
        (((x - self.origin.x) * self.per_m) as usize).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.origin.y) * self.per_m) as usize).min(self.rows - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::testing::disc_at;
    use proptest::prelude::*;

    /// What a tick costs grows with those in range, not with the fleet: on a lattice of the same density as many bodies
    /// are looked at for each of them, however many there are.
    #[test]
    fn a_visit_of_the_neighbourhood_does_not_grow_with_the_fleet() {
        for side in [8, 16, 32] {
            let place = |i: usize| Point2::new((i % side) as f64, (i / side) as f64) * 2.0;
            let bodies: Vec<Body> = (0..side * side).map(|i| disc_at(i, place(i), 0.2)).collect();
            let mut grid = Grid::default();
            grid.rebuild(&bodies);
            let mut looks = 0;
            for body in &bodies {
                grid.visit(Aabb::around([body.pose.position]).grown(4.2), |_| looks += 1);
            }
            let each = looks / bodies.len();
            assert!((9..=49).contains(&each), "{} bodies: {each} looks at others for each", bodies.len());
        }
    }

    proptest! {
        #[test]
        fn a_visit_finds_every_body_inside_and_none_twice(
            places in prop::collection::vec((-9.0..9.0f64, -2.0..2.0f64), 0..60),
            low in (-12.0..12.0f64, -4.0..4.0f64), size in (0.0..30.0f64, 0.0..8.0f64), flat: bool
        ) {
            let place = |(x, y): &(f64, f64)| Point2::new(*x, if flat { 0.0 } else { *y });
            let bodies: Vec<Body> = places.iter().enumerate().map(|(i, p)| disc_at(i, place(p), 0.1)).collect();
            let mut grid = Grid::default();
            grid.rebuild(&bodies);
            let area = Aabb { low: Point2::new(low.0, low.1), high: Point2::new(low.0 + size.0, low.1 + size.1) };
            let mut found = vec![0; bodies.len()];
            grid.visit(area, |item| found[item.robot.at()] += 1);
            for (body, times) in bodies.iter().zip(&found) {
                prop_assert!(*times <= 1 && (*times == 1 || !area.contains(body.pose.position)));
            }
            let mut all = Vec::new();
            grid.visit(area.grown(f64::INFINITY), |item| all.push(item.robot));
            prop_assert_eq!(all.len(), bodies.len());
        }
    }
}
