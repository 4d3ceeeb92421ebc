//! Tables in Markdown.

use std::fmt;

/// A table that is written row by row.
pub struct Table {
    titles: Vec<String>,
    /// How many of the first columns have text.
    text: usize,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table whose first `text` columns have text and the others figures.
    pub fn new(titles: impl IntoIterator<Item = impl Into<String>>, text: usize) -> Self {
        Self {
            titles: titles.into_iter().map(Into::into).collect(),
            text,
            rows: Vec::new(),
        }
    }

    /// Adds a row; what it lacks stays empty.
    pub fn push(&mut self, mut row: Vec<String>) {
        row.resize(self.titles.len(), String::new());
        self.rows.push(row);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cell = |text: &String| text.replace('|', "\\|").replace(['\n', '\r'], " ");
        let line = |f: &mut fmt::Formatter<'_>, cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(cell).collect();
            writeln!(f, "| {} |", cells.join(" | "))
        };
        line(f, &self.titles)?;
        let rule = |i: usize| if i < self.text { "---" } else { "---:" }.to_string();
        line(f, &(0..self.titles.len()).map(rule).collect::<Vec<_>>())?;
        self.rows.iter().try_for_each(|row| line(f, row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_rows_are_filled_and_cells_keep_to_themselves() {
        let mut table = Table::new(["a", "b", "c"], 1);
        table.push(vec!["x | y\nz".to_string(), "1".to_string()]);
        let expected = "| a | b | c |\n| --- | ---: | ---: |\n| x \\| y z | 1 |  |\n";
        assert_eq!(table.to_string(), expected);
    }
}
