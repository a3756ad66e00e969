//! Formats points for reports, in hundredths. Rounding never shows a part as all of the points, or as none. `–` means
//! that nothing was judged, or that points are withheld.

use super::Credit;
use crate::rubric::FaultPoints;
use crate::rubric::creative::CreativeCredit;

/// `value` with at most two decimals.
pub fn shown(value: f64) -> String {
    trimmed(&format!("{value:.2}"))
}

/// Points earned. A part is never shown as all points or as 0.
pub fn earned(credit: &Credit, faults: FaultPoints) -> String {
    credit.shown(faults).map_or_else(|| "–".to_owned(), |earned| part(earned, credit.points))
}

/// Points not judged, with the same rounding.
pub fn unjudged(credit: &Credit) -> String {
    part(credit.unjudged, credit.points)
}

/// `1.5/2`.
pub fn of(credit: &Credit, faults: FaultPoints) -> String {
    format!("{}/{}", earned(credit, faults), shown(credit.points))
}

/// `1.5 of 2`, followed by the points not judged.
pub fn in_words(credit: &Credit, faults: FaultPoints, noun: &str) -> String {
    let text = format!("{} of {}{noun}", earned(credit, faults), shown(credit.points));
    if credit.unjudged > 0.0 { format!("{text}, {} not judged", unjudged(credit)) } else { text }
}

/// Text in the place of points for a creative scene without marks.
pub const NO_MARK: &str = "no mark";

/// Points for a creative scene, earned and maximum; [`NO_MARK`] if it has none.
pub fn creative(creative: &CreativeCredit, faults: FaultPoints) -> (String, String) {
    let earned = Credit::of_creative(creative).map(|credit| earned(&credit, faults));
    (earned.unwrap_or_else(|| NO_MARK.to_owned()), shown(creative.points))
}

fn part(value: f64, points: f64) -> String {
    let text = shown(value);
    match () {
        () if value < points && text == shown(points) => {
            trimmed(&format!("{:.2}", (value * 100.0).floor() / 100.0))
        }
        () if value > 0.0 && text == "0" => "0.01".to_owned(),
        () => text,
    }
}

fn trimmed(text: &str) -> String {
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_credit_never_rounds_to_zero_or_full() {
        let of =
            |earned, points| of(&Credit { points, earned, unjudged: 0.0 }, FaultPoints::Withheld);
        assert_eq!(of(2.0 / 3.0, 1.0), "0.67/1");
        assert_eq!(of(1.0, 1.0), "1/1");
        assert_eq!(of(0.999, 1.0), "0.99/1");
        assert_eq!(of(9.999, 10.0), "9.99/10");
        assert_eq!(of(0.001, 10.0), "0.01/10");
        assert_eq!(of(0.0, 2.5), "0/2.5");
        assert_eq!(shown(100.0), "100");
    }

    #[test]
    fn points_not_judged_are_shown_apart() {
        let words = |earned, unjudged, faults| {
            in_words(&Credit { points: 43.0, earned, unjudged }, faults, " points")
        };
        let (apart, withheld) = (FaultPoints::Apart, FaultPoints::Withheld);
        assert_eq!(words(30.0, 5.0, apart), "30 of 43 points, 5 not judged");
        assert_eq!(words(30.0, 5.0, withheld), "– of 43 points, 5 not judged");
        assert_eq!(words(42.999, 0.001, apart), "42.99 of 43 points, 0.01 not judged");
        assert_eq!(words(0.0, 43.0, apart), "– of 43 points, 43 not judged");
        assert_eq!(words(0.0, 0.0, withheld), "0 of 43 points");
    }
}
