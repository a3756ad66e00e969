//! The numbers of the search: what each means, why it has that value, and what moving it does.
//!
//! `docs/selftest.md` has the last, measured: each number is moved down and up, and the same drawn programs are searched.

macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident: $type:ty = $value:expr,)*) => {
        /// The numbers that a search depends on.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Thresholds {
            $($(#[$doc])* pub $name: $type,)*
        }

        impl Default for Thresholds {
            fn default() -> Self {
                Self { $($name: $value,)* }
            }
        }

        impl Thresholds {
            /// The name of every number.
            pub const ALL: &'static [&'static str] = &[$(stringify!($name),)*];

            /// The number of this name; NaN for an unknown name.
            pub fn number(&self, name: &str) -> f64 {
                match name {
                    $(stringify!($name) => self.$name as f64,)*
                    _ => f64::NAN,
                }
            }

            /// These with one of them multiplied; counts are rounded down.
            pub fn moved(mut self, name: &str, factor: f64) -> Self {
                match name {
                    $(stringify!($name) => {
                        self.$name = (self.$name as f64 * factor) as $type;
                    })*
                    _ => {}
                }
                self
            }
        }
    };
}

thresholds! {
    /// Multiple of its noise that the residual of a sampled step may be. The noise is estimated from three perturbed steps,
    /// so its own error is of its size.
    left: f64 = 3.0,
    /// Multiple of its noise from which a defect shows one change from another: below, many changes cancel it.
    clear: f64 = 300.0,
    /// Multiple of its noise from which a residual tells which particles are wrong: what they share is said of them.
    clearly: f64 = 30.0,
    /// Spread of two replays whose last bits differ, relative to the motion, at which states are no longer compared.
    chaotic: f64 = 1e-3,
    /// Wrong steps of a scene by which changes are chosen first. One step of few particles has more changes than numbers.
    first: usize = 4,
    /// Scenes in which changes are enumerated, in each round; half as many for pairs.
    tried: usize = 8,
    /// Changes of a scene that are compared with other scenes, and those among them in one place.
    weighed: usize = 48,
    /// See `weighed`.
    weighed_of_place: usize = 8,
    /// Other scenes, one step of each, that these are compared with.
    probed: usize = 24,
    /// The best of these, which are compared with all sampled steps, with one in each of as many other places.
    weighed_fully: usize = 6,
    /// Changes that are replayed in a round, until one is proven.
    replayed: usize = 12,
    /// Scenes that passed and that are replayed with a change. One that differs refutes it.
    passed: usize = 12,
    /// Processor time of a search in milliseconds, counted by what it computes and not timed, so that the same traces have the
    /// same findings on every machine. The findings by then are reported. Without it, two mistakes that are not
    /// found take up to 34 s.
    ceiling: u64 = 10_000,
    /// Mistakes: changes other than features that are left out. More are found in the same traces by chance.
    mistakes: usize = 4,
    /// Searches repeated without what explains fewer scenes than it leaves.
    retries: usize = 2,
    /// A submission of fewer scenes than this has scenes enough if it has one.
    small: usize = 10,
    /// The rank from which a change is far-fetched: only most of its scenes prove it.
    far_fetched: u8 = 3,
    /// Scenes that are explained, for each that is not, from which nearly all are.
    most: usize = 9,
    /// Changes that explain some of the scenes of a cause, kept to be tried with other causes.
    rivals: usize = 12,
    /// Forces whose Jacobians are named one by one, where the same mistake is in all of them and in the matrix alike.
    together: usize = 3,
    /// Relative distance of a fitted number from a power of the time step at which it is taken for that.
    accidental: f64 = 1e-4,
    /// Fitted factors below this are no finding: a scene of few forces determines them by its rounding.
    tiny: f64 = 1e-6,
    /// Rules on some elements of a force that one scene allows, and that are compared with the others.
    gates: usize = 24,
    /// Coordinates of the largest scenes in which numbers in formulas are looked for.
    numbered: usize = 40,
}
