//! Lines that fit: wrapping, rows of a label and a value, tables.

/// Narrower than this nothing is laid out.
pub const WIDTH_MIN: usize = 24;

/// How to lay out and paint text.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// No line is longer than this many characters.
    pub width: usize,
    /// Whether to colour.
    pub color: bool,
}

/// Text that grows line by line; no line is longer than the width.
pub struct Page {
    width: usize,
    text: String,
}

impl Page {
    /// An empty page of this many columns.
    pub fn new(width: usize) -> Page {
        Page { width: width.max(WIDTH_MIN), text: String::new() }
    }

    /// Its columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// All lines, each with its end.
    pub fn into_text(self) -> String {
        self.text
    }

    /// An empty line, unless the page is empty or ends in one.
    pub fn gap(&mut self) {
        if !self.text.is_empty() && !self.text.ends_with("\n\n") {
            self.text.push('\n');
        }
    }

    /// Words, broken between words; lines after the first are indented by `hanging`.
    pub fn words(&mut self, words: &str, hanging: usize) {
        self.wrapped(String::new(), words, hanging);
    }

    /// The same, behind a start that is never broken.
    pub fn words_after(&mut self, start: &str, words: &str, hanging: usize) {
        self.wrapped(start.to_string(), words, hanging);
    }

    /// `  label   value`, the value broken between words under itself.
    pub fn row(&mut self, label: &str, value: &str) {
        const VALUE_AT: usize = 18;
        let at = VALUE_AT.min(self.width / 2 - 2);
        self.wrapped(format!("  {label:<pad$} ", pad = at - 3), value, at);
    }

    /// A line of a table, cut off at the width.
    pub fn line(&mut self, line: &str) {
        self.text.push_str(&cut(line.trim_end(), self.width));
        self.text.push('\n');
    }

    /// A line that is not cut, for what is copied: a command.
    pub fn whole(&mut self, line: &str) {
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn wrapped(&mut self, start: String, words: &str, hanging: usize) {
        let hanging = hanging.min(self.width / 2);
        let mut line = start;
        let mut len = line.chars().count();
        let mut empty = true;
        for word in words.split_whitespace() {
            let mut word: Vec<char> = word.chars().collect();
            let space = usize::from(!empty);
            if len + space + word.len() > self.width && !empty {
                self.line(&line);
                line = " ".repeat(hanging);
                len = hanging;
                empty = true;
            }
            if !empty {
                line.push(' ');
                len += 1;
            }
            // A word that does not fit a line of its own is broken anywhere.
            while len + word.len() > self.width {
                let rest = word.split_off(self.width.saturating_sub(len).max(1).min(word.len()));
                line.extend(word);
                self.line(&line);
                line = " ".repeat(hanging);
                len = hanging;
                word = rest;
            }
            len += word.len();
            line.extend(word);
            empty = false;
        }
        self.line(&line);
    }
}

/// The first `width` characters; what is missing is said with `…`.
pub fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_string();
    }
    let mut cut: String = text.chars().take(width.saturating_sub(1)).collect();
    cut.push('…');
    cut
}

/// A column of a table.
pub struct Column {
    /// Its heading.
    pub head: &'static str,
    /// Words are on the left, numbers on the right.
    pub left: bool,
    /// Columns with larger numbers go first where there is no room; 0 always stays.
    pub rank: u8,
    /// Longer cells are cut.
    pub width_max: usize,
}

impl Column {
    /// A column of words.
    pub const fn left(head: &'static str, rank: u8, width_max: usize) -> Column {
        Column { head, left: true, rank, width_max }
    }

    /// A column of numbers.
    pub const fn right(head: &'static str, rank: u8) -> Column {
        Column { head, left: false, rank, width_max: 20 }
    }
}

/// Lines of a table: a heading and the rows, with as many columns as fit, none wider than the width. Columns without
/// any content are left out.
pub fn table(columns: &[Column], rows: &[Vec<String>], indent: usize, width: usize) -> Vec<String> {
    let widths: Vec<usize> = (columns.iter().enumerate())
        .map(|(i, column)| {
            let cells = rows.iter().map(|row| row[i].chars().count());
            cells.max().unwrap_or(0).max(column.head.chars().count()).min(column.width_max)
        })
        .collect();
    let mut kept: Vec<usize> =
        (0..columns.len()).filter(|&i| rows.is_empty() || rows.iter().any(|row| !row[i].is_empty())).collect();
    let total = |kept: &[usize]| indent + kept.iter().map(|&i| widths[i] + 2).sum::<usize>().saturating_sub(2);
    while total(&kept) > width {
        let Some(&worst) = kept.iter().filter(|&&i| columns[i].rank > 0).max_by_key(|&&i| columns[i].rank) else {
            break;
        };
        kept.retain(|&i| i != worst);
    }
    let line = |cell: &dyn Fn(usize) -> String| {
        let mut line = " ".repeat(indent);
        for (place, &i) in kept.iter().enumerate() {
            let (text, pad) = (cut(&cell(i), widths[i]), widths[i]);
            line.push_str(if place > 0 { "  " } else { "" });
            line.push_str(&if columns[i].left { format!("{text:<pad$}") } else { format!("{text:>pad$}") });
        }
        cut(line.trim_end(), width)
    };
    let head = line(&|i| columns[i].head.to_string());
    std::iter::once(head).chain(rows.iter().map(|row| line(&|i| row[i].clone()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_longer_than_the_width() {
        for width in [WIDTH_MIN, 40, 80] {
            let mut page = Page::new(width);
            page.words(&format!("{} some words {}", "x".repeat(100), "y".repeat(width)), 4);
            page.row("a label that is rather long", "and a value of several words");
            page.row("label", &"z".repeat(90));
            page.line(&"w".repeat(200));
            let text = page.into_text();
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            assert_eq!(text.chars().filter(|&c| c == 'x').count(), 100, "wrapping loses nothing");
            assert_eq!(text.chars().filter(|&c| c == 'z').count(), 90, "wrapping loses nothing");
        }
    }

    #[test]
    fn tables_lose_columns_before_they_lose_digits() {
        let columns = [Column::left("id", 0, 8), Column::right("time", 0), Column::right("pid", 1)];
        let rows = [vec!["r01".into(), "12.5".into(), "4711".into()], vec!["r02".into(), "-".into(), "4712".into()]];
        assert_eq!(table(&columns, &rows, 2, 40), ["  id   time   pid", "  r01  12.5  4711", "  r02     -  4712"]);
        assert_eq!(table(&columns, &rows, 2, 12), ["  id   time", "  r01  12.5", "  r02     -"]);
    }
}
