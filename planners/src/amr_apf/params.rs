//! Parameters of AMR-APF, and the presets: which program of the authors has which values.

use super::speed::{Pivot, SpeedLaw};
use model::ParamValues;

crate::choice! {
    /// Where the parameters start from.
    pub enum Preset {
        /// `fixed` with what the paper lacks, brakes and a way out of standstill, and without what they make needless.
        Fleet = "fleet",
        /// `p` with its oversights put right.
        Fixed = "fixed",
        /// `fixed` with the equations as the paper's text has them, as far as it can be read.
        Text = "text",
        /// The program of the paper's first experiment.
        C1 = "c1",
        /// The program nearest to the paper's text.
        P = "p",
        /// The authors' later program.
        H = "h",
    }
}

crate::choice! {
    /// When things push to the side.
    pub enum Rule {
        /// Between ρ and 2ρ, with the goal beyond the thing, and farther out only if the robot faces it.
        Rings = "rings",
        /// Wherever the thing is in the half-plane of the goal.
        HalfPlane = "half-plane",
    }
}

crate::choice! {
    /// Which of two robots that would turn into each other takes the other side.
    pub enum Side {
        /// The one that has not the right of way (Eq. 6).
        RightOfWay = "right-of-way",
        /// The one whose heading is farther off the line of sight.
        Offsets = "offsets",
    }
}

crate::choice! {
    /// What stands between a parked robot and a pillar that close a gap together (Eq. 9).
    pub enum Traps {
        /// Nothing.
        Off = "off",
        /// A small parked robot.
        Parked = "parked",
        /// An obstacle of a third of the gap.
        Obstacle = "obstacle",
        /// A circle that covers both zones, if the zones meet: (d + ρ_r + ρ_o) / 2.
        Cover = "cover",
        /// A circle that reaches half as far beyond the two: d / 2 + (ρ_r + ρ_o) / 4.
        Half = "half",
    }
}

crate::choice! {
    /// What stands between two pillars that close a gap (Eq. 9).
    pub enum PillarGaps {
        /// Nothing.
        Off = "off",
        /// A pillar of the same size, if the gap is open but too narrow.
        Midpoint = "midpoint",
        /// A circle that covers both zones, if the zones meet: (d + ρ_1 + ρ_2) / 2.
        Cover = "cover",
        /// A circle that reaches half as far beyond the two: d / 2 + (ρ_1 + ρ_2) / 4.
        Half = "half",
    }
}

crate::choice! {
    /// Which crowds act.
    pub enum Which {
        /// None.
        Off = "off",
        /// All.
        All = "all",
        /// The one with the largest circle.
        Largest = "largest",
        /// The one with most members.
        Fullest = "fullest",
    }
}

crate::choice! {
    /// The circle around a crowd (Eq. 10).
    pub enum Circle {
        /// The smallest one.
        Enclosing = "enclosing",
        /// By the shorter side of the smallest rectangle.
        Rectangle = "rectangle",
        /// Around the mean of the corners of the hull.
        Mean = "mean",
    }
}

crate::choice! {
    /// How a crowd acts.
    pub enum ClusterRule {
        /// Obliquely back, within twice its radius; backwards if the goal is not beyond it.
        Oblique = "oblique",
        /// The same without the limit.
        ObliqueUncut = "oblique-uncut",
        /// Sideways only, and only while nothing else is near; only moving robots on the side of the goal count.
        Tangent = "tangent",
    }
}

crate::choice! {
    /// How the forward force becomes speed.
    pub enum SpeedRule {
        /// By its square.
        Square = "square",
        /// By its square, a linear part, and a little always.
        Lifted = "lifted",
    }
}

crate::params! {
    /// Parameters that a scenario can set. Values that are not given are those of the preset; the table shows `fleet`.
    pub struct Params {
        /// Preset of all values that are not given.
        preset: Preset = Preset::Fleet, "";
        /// Size of the pull C_a. Larger: all forces larger; only their ratio to the k counts.
        c_a: f64 = 4.0, "", 0.1..=100.0;
        /// The pull is doubled nearer than this to the goal. Larger: hurries sooner.
        near_goal_m: f64 = 0.5, "m", 0.0..=100.0;
        /// Safety distance s, part of every ρ. Larger: wider around everything.
        safety_m: f64 = 0.07, "m", 0.0..=10.0;
        /// Added to the radius of every robot, own and others, for bodies that are not round. Larger: wider around
        /// robots than around obstacles.
        margin_m: f64 = 0.0, "m", 0.0..=10.0;
        /// Where every zone ends: 2 as in the programs, 1 as the paper's text has it. The push is C_a at half of it.
        reach: f64 = 2.0, "ρ", 0.1..=10.0;
        /// Power of the bracket of Eq. 2: 2 as in the programs, 1 as in the classical field. Larger: softer at the edge.
        bracket_power: u32 = 2, "", 1..=2;
        /// When obstacles push to the side.
        obstacle_rule: Rule = Rule::Rings, "";
        /// When robots push to the side.
        robot_rule: Rule = Rule::Rings, "";
        /// Half angle dead ahead within which an obstacle is passed on the side of the goal. Larger: more often.
        phi_o_deg: f64 = 20.0, "°", 0.0..=180.0;
        /// The same for parked robots.
        phi_r_deg: f64 = 10.0, "°", 0.0..=180.0;
        /// Part of the sideways force of obstacles that does not fade. Larger: turns aside harder.
        k_o: f64 = 3.0, "", 0.0..=100.0;
        /// The same for robots beyond 1.5 ρ_r (with the rule `half-plane` everywhere).
        k_r_far: f64 = 2.0, "", 0.0..=100.0;
        /// The same for robots nearer than 1.5 ρ_r.
        k_r_near: f64 = 4.0, "", 0.0..=100.0;
        /// Whether right of way is used.
        right_of_way: bool = true, "";
        /// Whether a robot that stopped on purpose keeps its right of way.
        stopped_keeps_way: bool = false, "";
        /// Which robot changes sides when two would turn into each other.
        side: Side = Side::Offsets, "";
        /// A robot nearer than ρ_r within this angle ahead stops us. Larger: stops more often.
        front_half_angle_deg: f64 = 45.0, "°", 0.0..=180.0;
        /// Whether to wait behind a robot that goes the same way and has right of way.
        follow_stop: bool = false, "";
        /// Whether a robot that leaves in front of us stops pushing.
        yield_without_force: bool = false, "";
        /// What stands between a parked robot and a pillar that close a gap together.
        traps: Traps = Traps::Parked, "";
        /// What stands between two pillars that close a gap.
        pillar_gaps: PillarGaps = PillarGaps::Midpoint, "";
        /// Which crowds act.
        clusters: Which = Which::Off, "";
        /// The circle around a crowd.
        circle: Circle = Circle::Enclosing, "";
        /// How a crowd acts.
        cluster_rule: ClusterRule = ClusterRule::Oblique, "";
        /// Robots within this distance may belong to a crowd. Larger: sees crowds sooner.
        c_r: f64 = 2.5, "2ρ_r", 0.0..=100.0;
        /// No crowds when the goal is nearer than this. Larger: stops looking sooner.
        c_g: f64 = 2.5, "2ρ_r", 0.0..=100.0;
        /// Robots nearer to each other than this belong together. Larger: looser crowds.
        c_adj: f64 = 2.2, "ρ_r", 0.0..=100.0;
        /// Size of the circle by rectangle. Larger: wider around crowds.
        c_rad: f64 = 2.5, "", 0.0..=100.0;
        /// Which of equally small rectangles: from which edge on to look for them; 0 leaves it to rounding.
        rectangle_tie: u32 = 0, "", 0..=3;
        /// Whether two arrived robots belong together.
        link_arrived: bool = true, "";
        /// A robot inside a crowd waits this long, then ignores it as long; 0 waits for ever.
        crowd_wait_s: f64 = 5.0, "s", 0.0..=1e6;
        /// How the forward force becomes speed.
        speed_rule: SpeedRule = SpeedRule::Square, "";
        /// Turn rate at 0.2 m/s per sideways force of C_a; grows with the speed limit. Larger: turns sharper.
        turn_gain: f64 = 5.0, "rad/s", 0.0..=100.0;
        /// Speed of a robot that would neither drive nor turn. Larger: leaves equilibria sooner.
        creep: f64 = 0.25, "v_max", 0.0..=1.0;
        /// Do not creep towards what is near ahead, nor turn beyond the direction of the force in one tick.
        guarded: bool = true, "";
        /// Drive no faster towards a thing than lets the robot stop this far from its surface; 0 does not brake. Larger:
        /// keeps clear of more.
        keep_m: f64 = 0.02, "m", 0.0..=10.0;
        /// A robot that has come no nearer to its goal for this long makes a detour; 0: never. Larger: waits longer where it
        /// is stuck.
        patience_s: f64 = 4.0, "s", 0.0..=1e6;
        /// How long the first detour takes, on average. Larger: comes out of deeper traps sooner, wastes more elsewhere.
        detour_s: f64 = 2.0, "s", 0.0..=1e6;
        /// Once stopped on purpose, tell so for good (until there is another goal).
        sticky_stop: bool = false, "";
        /// Age up to which a robot is taken to have kept its course. Larger: trusts the course longer.
        stale_s: f64 = 0.3, "s", 0.0..=60.0;
        /// Age from which a silent robot is forgotten; until then it is parked. Larger: keeps away from it longer.
        drop_s: f64 = 2.0, "s", 0.0..=60.0;
        /// Forces to three decimals, and the other oddities of the programs: for comparing step counts.
        exact: bool = false, "";
        /// sgn(0) = 0 as in the programs: a robot that faces an obstacle exactly is pushed towards it.
        sgn_zero: bool = false, "";
    }
}

impl Params {
    /// The preset named in `values`, with the other values on top.
    pub fn of_values(values: &ParamValues) -> Params {
        let preset = Params::preset.given(values).unwrap_or(Preset::Fleet);
        Params::of(preset).with(values)
    }

    /// The values of a preset.
    pub fn of(preset: Preset) -> Params {
        let fleet = Params::default();
        let fixed = Params {
            preset: Preset::Fixed,
            side: Side::RightOfWay,
            follow_stop: true,
            clusters: Which::All,
            keep_m: 0.0,
            patience_s: 0.0,
            ..fleet
        };
        let p = Params {
            preset: Preset::P,
            pillar_gaps: PillarGaps::Off,
            clusters: Which::Largest,
            circle: Circle::Rectangle,
            crowd_wait_s: 0.0,
            guarded: false,
            sticky_stop: true,
            ..fixed
        };
        match preset {
            Preset::Fleet => fleet,
            Preset::Fixed => fixed,
            // Sideways as hard as back, wherever a thing is in the way; Eq. 9 as a circle over both zones.
            Preset::Text => Params {
                preset,
                reach: 1.0,
                bracket_power: 1,
                obstacle_rule: Rule::HalfPlane,
                k_o: 0.0,
                k_r_far: 0.0,
                k_r_near: 0.0,
                traps: Traps::Cover,
                pillar_gaps: PillarGaps::Cover,
                ..fixed
            },
            Preset::P => p,
            Preset::C1 => Params {
                preset,
                k_o: 2.0,
                stopped_keeps_way: true,
                side: Side::Offsets,
                front_half_angle_deg: 90.0,
                follow_stop: false,
                yield_without_force: true,
                clusters: Which::All,
                cluster_rule: ClusterRule::ObliqueUncut,
                c_r: 3.0,
                c_g: 3.0,
                link_arrived: false,
                speed_rule: SpeedRule::Lifted,
                turn_gain: 3.0,
                ..p
            },
            Preset::H => Params {
                preset,
                safety_m: 0.1,
                obstacle_rule: Rule::HalfPlane,
                robot_rule: Rule::HalfPlane,
                k_r_far: 3.0,
                right_of_way: false,
                traps: Traps::Obstacle,
                clusters: Which::Fullest,
                circle: Circle::Mean,
                cluster_rule: ClusterRule::Tangent,
                c_r: 3.0,
                c_g: 2.0,
                sticky_stop: false,
                ..p
            },
        }
    }

    /// From force to command.
    pub fn speed_law(&self) -> SpeedLaw {
        let (linear, floor) = match self.speed_rule {
            SpeedRule::Square => (0.0, 0.0),
            SpeedRule::Lifted => (0.25, 0.25),
        };
        SpeedLaw {
            linear,
            floor,
            turn_gain: self.turn_gain,
            pivot: Pivot::Backwards,
            creep_below: 0.0,
            creep: self.creep,
            guarded: self.guarded,
        }
    }
}
