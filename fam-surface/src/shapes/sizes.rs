//! Sizes that shapes can be made in.

/// The number itself if it lies between `low` and `high`, else the nearer of the two; `high` for
/// what is no number.
pub(super) fn within(number: f64, low: f64, high: f64) -> f64 {
    if number.is_nan() {
        high
    } else {
        number.clamp(low, high)
    }
}
