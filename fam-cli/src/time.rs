//! Lengths of time as the command line has them.

use std::time::Duration;

/// A year, in seconds.
const LONGEST: f64 = 366.0 * 86_400.0;

/// A length of time: `90`, `90s`, `2m`, `1.5h`.
pub fn duration(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) => (number, &text[number.len()..]),
        None => (text, "s"),
    };
    let factor = match unit {
        "h" => 3600.0,
        "m" => 60.0,
        _ => 1.0,
    };
    let seconds = number.parse::<f64>().ok().map(|n| n * factor);
    seconds
        .filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST)
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| "a time is a number above 0 and s, m or h, such as 30s".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, seconds) in [("30", 30.0), ("30s", 30.0), ("2m", 120.0), ("1.5h", 5400.0)] {
            assert_eq!(
                duration(text),
                Ok(Duration::from_secs_f64(seconds)),
                "{text}"
            );
        }
        for text in [
            "", "s", "0", "-1s", "nan", "inf", "1e30h", "9999h9", "9000h", "3 s", "30ms",
        ] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
