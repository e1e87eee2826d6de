//! [`Html`]: text of a page. Markup comes from the source alone, and everything else is escaped.

use std::fmt::{Display, Write};

use super::super::svg::{Svg, escape};

/// The text of a page or of a part of it.
#[derive(Default)]
pub(super) struct Html {
    text: String,
}

impl Html {
    /// Adds markup. A name from a file cannot live long enough to be markup.
    pub fn markup(&mut self, markup: &'static str) -> &mut Self {
        self.text.push_str(markup);
        self
    }

    /// Adds a text from anywhere.
    pub fn text(&mut self, text: impl Display) -> &mut Self {
        self.text.push_str(&escape(text));
        self
    }

    /// Adds an element with a text from anywhere.
    ///
    /// - `tag`: the name of the element, and its attributes
    pub fn element(&mut self, tag: &'static str, text: impl Display) -> &mut Self {
        let name = tag.split(' ').next().unwrap_or_default();
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "<{tag}>{}</{name}>", escape(text));
        self
    }

    /// Adds a picture.
    pub fn picture(&mut self, svg: Svg) -> &mut Self {
        self.text.push_str(&svg.finish());
        self
    }

    /// Adds a table. The first column stands at the left, the others at the right.
    pub fn table(&mut self, header: &[&'static str], rows: &[Vec<String>]) -> &mut Self {
        self.rows(header, rows, false)
    }

    /// [`Html::table`] with rows that have numbers from 0 for the script, and that can be chosen.
    pub fn chosen(&mut self, header: &[&'static str], rows: &[Vec<String>]) -> &mut Self {
        self.rows(header, rows, true)
    }

    /// [`Html::table`] with pictures in the second last column.
    ///
    /// - `rows`: the texts of the other columns, and the pictures
    pub fn pictured(&mut self, header: &[&'static str], rows: Vec<(Vec<String>, Vec<Svg>)>) -> &mut Self {
        self.header(header);
        for (row, pictures) in rows {
            self.markup("<tr>");
            let (last, others) = row.split_last().map_or(("", &[][..]), |(last, others)| (last.as_str(), others));
            for cell in others {
                self.element("td", cell);
            }
            self.markup("<td>");
            for picture in pictures {
                self.picture(picture);
            }
            self.markup("</td>\n").element("td", last).markup("</tr>\n");
        }
        self.markup("</tbody></table></div>\n")
    }

    fn header(&mut self, header: &[&'static str]) {
        self.markup("<div class=\"scroll\"><table><thead><tr>");
        for name in header {
            self.element("th scope=\"col\"", name);
        }
        self.markup("</tr></thead><tbody>\n");
    }

    fn rows(&mut self, header: &[&'static str], rows: &[Vec<String>], chosen: bool) -> &mut Self {
        self.header(header);
        for (number, row) in rows.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = match chosen {
                true => write!(self.text, "<tr data-cell=\"{number}\" tabindex=\"0\">"),
                false => write!(self.text, "<tr>"),
            };
            for cell in row {
                self.element("td", cell);
            }
            self.markup("</tr>\n");
        }
        self.markup("</tbody></table></div>\n")
    }

    /// Adds data for a script, as the content of a script element that no browser runs.
    pub fn data(&mut self, id: &'static str, value: &serde_json::Value) -> &mut Self {
        // `<` would begin the end of the element, or a comment.
        let text = value.to_string().replace('<', "\\u003c");
        let _ = writeln!(self.text, "<script type=\"application/json\" id=\"{id}\">{text}</script>");
        self
    }

    /// Adds packed bytes for a script, in base64.
    pub fn packed(&mut self, id: &'static str, base64: &str) -> &mut Self {
        let _ = writeln!(self.text, "<script type=\"text/plain\" id=\"{id}\">{base64}</script>");
        self
    }

    /// The number of bytes so far.
    pub fn n_bytes(&self) -> usize {
        self.text.len()
    }

    /// The whole text.
    pub fn finish(self) -> String {
        self.text
    }
}

/// A number with four digits, with an exponent if it is very small or very large.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "\u{2013}".to_owned()
    } else if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// A count with no-break spaces between groups of three digits.
pub(super) fn count(value: usize) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(digit);
    }
    text
}

/// A position with four digits a coordinate.
pub(super) fn place(at: [f64; 3]) -> String {
    let [x, y, z] = at.map(number);
    format!("({x}, {y}, {z})")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if a text can end its element, or open another one.
    #[test]
    fn names_stay_text() {
        let name = "</script><img src=x onerror=alert(1)>\"'&";
        let mut html = Html::default();
        html.element("p", name).table(&["name"], &[vec![name.to_owned()]]);
        html.data("d", &serde_json::json!({ name: name }));
        let text = html.finish();
        assert_eq!(text.matches("</script>").count(), 1, "{text}");
        assert!(!text.contains("<img"), "{text}");
        let json = text.split_once("id=\"d\">").unwrap().1.split_once("</script>").unwrap().0;
        assert_eq!(serde_json::from_str::<serde_json::Value>(json).unwrap()[name], name);
    }

    #[test]
    fn numbers_have_four_digits() {
        let cases = [(0.0, "0"), (0.0092751, "0.009275"), (-1.5, "-1.5"), (20.0, "20"), (12345.6, "12346")];
        cases.iter().for_each(|&(value, text)| assert_eq!(number(value), text));
        assert_eq!([6.604e-6, 1e-4, f64::NAN].map(number), ["6.6e-6", "1e-4", "\u{2013}"]);
        assert_eq!((count(97694), count(12)), ("97\u{a0}694".to_owned(), "12".to_owned()));
    }
}
