//! SVG documents, written without a plotting library. The same numbers give the same bytes.

use std::fmt::{self, Display, Formatter, Write};

use crate::text::shown;

/// Colours that colour-blind readers can tell apart, also in print (Okabe and Ito).
pub const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

/// Names and values of an element's attributes.
pub type Attributes<'a> = [(&'a str, &'a dyn Display)];

/// A coordinate in pixels, written with one decimal.
#[derive(Clone, Copy, Debug)]
pub struct Pixels(pub f64);

impl Display for Pixels {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.1}", self.0)
    }
}

/// A picture on a white ground, with one element per line.
#[derive(Clone, Debug)]
pub struct Svg {
    text: String,
}

impl Svg {
    /// An empty picture.
    ///
    /// - `width`, `height`: in pixels
    /// - `title`: description for browsers and screen readers
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self { text: String::new() };
        svg.tag(
            "svg",
            &[
                ("xmlns", &"http://www.w3.org/2000/svg"),
                ("width", &width),
                ("height", &height),
                ("viewBox", &format_args!("0 0 {width} {height}")),
                ("font-family", &"sans-serif"),
                ("font-size", &13),
                ("fill", &"#222"),
            ],
            ">\n",
        );
        svg.tag("title", &[], ">");
        svg.content(title, "title");
        svg.element("rect", &[("width", &"100%"), ("height", &"100%"), ("fill", &"#fff")]);
        svg
    }

    /// An empty picture inside an HTML page, whose style sheet gives ground, colours and letters.
    ///
    /// - `width`, `height`: in pixels of the picture, which the page may scale
    /// - `title`: description for browsers and screen readers
    pub fn inline(width: f64, height: f64, title: &str) -> Self {
        Self::of_class("chart", width, height, title)
    }

    /// [`Svg::inline`] in the cell of a table.
    pub fn small(width: f64, height: f64, title: &str) -> Self {
        Self::of_class("small", width, height, title)
    }

    /// The number of bytes so far.
    pub fn n_bytes(&self) -> usize {
        self.text.len()
    }

    fn of_class(class: &str, width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self { text: String::new() };
        let view = format_args!("0 0 {width:.0} {height:.0}");
        svg.tag("svg", &[("class", &class), ("role", &"img"), ("viewBox", &view)], ">\n");
        svg.tag("title", &[], ">");
        svg.content(title, "title");
        svg
    }

    /// Adds an element without content, such as a `line`.
    pub fn element(&mut self, name: &str, attributes: &Attributes) {
        self.tag(name, attributes, "/>\n");
    }

    /// Adds a line of text.
    pub fn label(&mut self, attributes: &Attributes, text: impl Display) {
        self.tag("text", attributes, ">");
        self.content(text, "text");
    }

    /// The whole file.
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    fn tag(&mut self, name: &str, attributes: &Attributes, end: &str) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "<{name}");
        for (name, value) in attributes {
            let _ = write!(self.text, " {name}=\"{}\"", escape(value));
        }
        self.text.push_str(end);
    }

    fn content(&mut self, text: impl Display, of: &str) {
        let _ = writeln!(self.text, "{}</{of}>", escape(text));
    }
}

/// The text without characters that have a meaning in XML or HTML, or that XML excludes.
pub(super) fn escape(text: impl Display) -> String {
    shown(text).to_string().replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
