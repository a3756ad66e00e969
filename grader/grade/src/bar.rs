//! The bar of progress on standard error. A page of a browser has none: nothing is drawn there while a program runs.

#[cfg(not(target_family = "wasm"))]
mod shown {
    use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

    use super::TICK;

    /// A bar, visible if standard error is a terminal.
    pub(crate) struct Bar(ProgressBar);

    impl Bar {
        pub(crate) fn new(template: &str) -> Self {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template(template);
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            Self(bar)
        }

        /// Draws it at intervals as well.
        pub(crate) fn tick(&self) {
            self.0.enable_steady_tick(TICK);
        }

        pub(crate) fn advance(&self, done: usize, total: usize) {
            self.0.set_length(total as u64);
            self.0.set_position(done as u64);
        }

        pub(crate) fn say(&self, text: String) {
            self.0.set_message(text);
        }

        pub(crate) fn clear(&self) {
            self.0.finish_and_clear();
        }
    }
}

#[cfg(target_family = "wasm")]
mod shown {
    /// No bar.
    pub(crate) struct Bar;

    impl Bar {
        pub(crate) fn new(_template: &str) -> Self {
            Self
        }

        pub(crate) fn tick(&self) {}

        pub(crate) fn advance(&self, _done: usize, _total: usize) {}

        pub(crate) fn say(&self, _text: String) {}

        pub(crate) fn clear(&self) {}
    }
}

pub(crate) use shown::Bar;

/// Interval at which the elapsed time is redrawn.
#[cfg(not(target_family = "wasm"))]
const TICK: std::time::Duration = std::time::Duration::from_millis(200);
