//! Lines for a terminal, whatever the name of a file has in it.

use std::borrow::Cow;
use std::io::{ErrorKind, Write};

use serde::Serialize;

use crate::failure::Failure;

/// Prints a line on standard error. The work goes on where nobody reads it any more.
pub fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", plain(line));
}

/// Prints JSON on standard output.
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(value).map_err(Failure::work)?;
    match writeln!(std::io::stdout(), "{json}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::work(error)),
        // Whoever reads it may have read enough.
        _ => Ok(()),
    }
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
