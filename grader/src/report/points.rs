//! Points as reports show them: in hundredths, rounded, but never up to what was not reached.

/// `value` in hundredths at most.
pub(crate) fn shown(value: f64) -> String {
    trimmed(&format!("{value:.2}"))
}

/// What was earned of `points`: less than all is not shown as all, and more than nothing not as nothing.
pub(crate) fn earned(earned: f64, points: f64) -> String {
    let text = shown(earned);
    match () {
        () if earned < points && text == shown(points) => {
            trimmed(&format!("{:.2}", (earned * 100.0).floor() / 100.0))
        }
        () if earned > 0.0 && text == "0" => "0.01".to_owned(),
        () => text,
    }
}

/// `1.5/2`.
pub(crate) fn of(reached: f64, points: f64) -> String {
    format!("{}/{}", earned(reached, points), shown(points))
}

fn trimmed(text: &str) -> String {
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_rounded_to_all_or_to_nothing() {
        assert_eq!(of(2.0 / 3.0, 1.0), "0.67/1");
        assert_eq!(of(1.0, 1.0), "1/1");
        assert_eq!(of(0.999, 1.0), "0.99/1");
        assert_eq!(of(9.999, 10.0), "9.99/10");
        assert_eq!(of(0.001, 10.0), "0.01/10");
        assert_eq!(of(0.0, 2.5), "0/2.5");
        assert_eq!(shown(100.0), "100");
    }
}
