//! Lines for a terminal, whatever the name of a file has in it.

use std::borrow::Cow;
use std::io::Write;

/// Prints a line on standard error. The work goes on where nobody reads it any more.
pub fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", plain(line));
}

/// A text with its control characters escaped, such as line feeds and the codes of colours.
pub fn plain(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let escaped = |character: char| match character.is_control() {
        true => character.escape_default().to_string(),
        false => character.to_string(),
    };
    Cow::Owned(text.chars().map(escaped).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_control_characters_are_escaped() {
        assert_eq!(plain("ä b"), "ä b");
        assert_eq!(plain("a\nb\u{1b}[31m\u{9b}é"), "a\\nb\\u{1b}[31m\\u{9b}é");
    }
}
