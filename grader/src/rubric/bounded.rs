//! Numbers of a rubric with bounds, checked where the file is read.

/// Defines numbers whose values fulfil a condition, and the message for those that do not.
macro_rules! bounded {
    ($(#[$doc:meta])* $scope:vis struct $name:ident, |$value:ident| $is_valid:expr, $($message:tt)+) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
        #[serde(try_from = "f64")]
        $scope struct $name($scope f64);

        impl TryFrom<f64> for $name {
            type Error = String;

            fn try_from($value: f64) -> Result<Self, String> {
                if $is_valid { Ok(Self($value)) } else { Err(format!($($message)+)) }
            }
        }
    };
}

pub(super) use bounded;
