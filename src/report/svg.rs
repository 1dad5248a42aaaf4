//! A small writer of SVG.

use std::fmt::Write;

/// The fonts of all figures, in order of preference.
const FONTS: &str = "Helvetica, Arial, 'DejaVu Sans', sans-serif";

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke<'a> {
    /// A CSS colour.
    pub colour: &'a str,
    /// In the figure's units.
    pub width: f64,
    /// Lengths of dash and gap, as in `stroke-dasharray`; empty for an unbroken line.
    pub dash: &'a str,
}

impl<'a> Stroke<'a> {
    /// An unbroken line.
    pub fn solid(colour: &'a str, width: f64) -> Self {
        Self {
            colour,
            width,
            dash: "",
        }
    }
}

/// Which point of a text stands at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Font<'a> {
    /// In the figure's units.
    pub size: f64,
    /// A CSS colour.
    pub colour: &'a str,
    pub anchor: Anchor,
    pub bold: bool,
    /// Turned clockwise about its position, degrees.
    pub turn: f64,
}

impl<'a> Font<'a> {
    /// A bold text that starts at its position.
    pub fn bold(size: f64, colour: &'a str) -> Self {
        Self {
            bold: true,
            ..Self::new(size, colour, Anchor::Start)
        }
    }

    /// An upright text in the regular weight.
    pub fn new(size: f64, colour: &'a str, anchor: Anchor) -> Self {
        Self {
            size,
            colour,
            anchor,
            bold: false,
            turn: 0.0,
        }
    }
}

/// A figure being written: x to the right, y down, in pixels at its natural size.
#[derive(Debug, Clone, PartialEq)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    /// An empty figure on white. `title` is what a screen reader says of it.
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self {
            width,
            height,
            body: String::new(),
        };
        svg.push(format_args!("<title>{}</title>", escape(title)));
        svg.rectangle([0.0, 0.0], [width, height], "#ffffff");
        svg
    }

    /// A filled rectangle with its upper left corner at `corner`.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.push(format_args!(
            r#"<rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" fill="{fill}"/>"#
        ));
    }

    /// Filled rectangles, `(upper left corner, size)` each, that lie side by side without seams.
    pub fn rectangles(&mut self, all: &[([f64; 2], [f64; 2])], fill: &str) {
        if all.is_empty() {
            return;
        }
        let mut outline = String::new();
        for ([x, y], [width, height]) in all {
            let _ = write!(
                outline,
                "M{x:.2} {y:.2}h{width:.2}v{height:.2}h-{width:.2}z"
            );
        }
        let fill = escape(fill);
        self.push(format_args!(
            r#"<path d="{outline}" fill="{fill}" shape-rendering="crispEdges"/>"#
        ));
    }

    /// A line through the points with round joins.
    pub fn line(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        let mut list = String::new();
        for [x, y] in points {
            let _ = write!(list, "{x:.2},{y:.2} ");
        }
        let dash = match stroke.dash {
            "" => String::new(),
            dash => format!(r#" stroke-dasharray="{}""#, escape(dash)),
        };
        self.push(format_args!(
            r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="{:.2}" stroke-linecap="round" stroke-linejoin="round"{dash}/>"#,
            list.trim_end(),
            escape(stroke.colour),
            stroke.width
        ));
    }

    /// A circle.
    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str, stroke: Stroke) {
        self.push(format_args!(
            r#"<ellipse cx="{x:.2}" cy="{y:.2}" rx="{radius:.2}" ry="{radius:.2}" fill="{}" stroke="{}" stroke-width="{:.2}"/>"#,
            escape(fill),
            escape(stroke.colour),
            stroke.width
        ));
    }

    /// A text with its baseline at `position`.
    pub fn text(&mut self, position: [f64; 2], text: &str, font: Font) {
        let anchor = match font.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let [x, y] = position;
        let weight = match font.bold {
            true => r#" font-weight="bold""#,
            false => "",
        };
        let turn = match font.turn {
            0.0 => String::new(),
            turn => format!(r#" transform="rotate({turn} {x:.2} {y:.2})""#),
        };
        self.push(format_args!(
            r#"<text x="{x:.2}" y="{y:.2}" font-size="{}" fill="{}" text-anchor="{anchor}"{weight}{turn}>{}</text>"#,
            font.size,
            escape(font.colour),
            escape(text)
        ));
    }

    /// Sets a caption under the figure, which grows for it; lines break at the figure's width. An
    /// empty one changes nothing.
    pub fn caption(&mut self, caption: &str) {
        const SIZE: f64 = 13.0;
        const LINE: f64 = 18.0;
        if caption.is_empty() {
            return;
        }
        // 0.54 em is what a letter takes in the mean, a little generously.
        let fits = ((self.width - 32.0) / (0.54 * SIZE)) as usize;
        let lines = wrapped(caption, fits.max(20));
        let top = self.height;
        let room = LINE * lines.len() as f64 + 14.0;
        self.rectangle([0.0, top], [self.width, room], "#ffffff");
        self.height += room;
        self.begin_group("caption");
        for (index, line) in lines.iter().enumerate() {
            let at = [16.0, top + 10.0 + LINE * index as f64];
            self.text(at, line, Font::new(SIZE, "#222222", Anchor::Start));
        }
        self.end_group();
    }

    /// Opens a group that other programs find by its class; close it with [`Svg::end_group`].
    pub fn begin_group(&mut self, class: &str) {
        self.push(format_args!(r#"<g class="{}">"#, escape(class)));
    }

    /// Closes the group opened last.
    pub fn end_group(&mut self) {
        self.push(format_args!("</g>"));
    }

    /// The whole figure as an SVG document.
    pub fn finish(self) -> String {
        let (width, height) = (self.width, self.height);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"{FONTS}\">\n{}</svg>\n",
            self.body
        )
    }

    fn push(&mut self, element: std::fmt::Arguments) {
        let _ = writeln!(self.body, "{element}");
    }
}

/// Text in lines of at most `most` characters, broken at spaces and, as names of files and runs
/// need it, behind `_` and `-`. What cannot be broken has a line of its own. A no-break space
/// holds.
pub(super) fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        for (index, piece) in word.split_inclusive(['_', '-']).enumerate() {
            let space = if index == 0 { " " } else { "" };
            let length = space.len() + piece.chars().count();
            match lines.last_mut() {
                Some(line) if line.chars().count() + length <= most => {
                    line.push_str(space);
                    line.push_str(piece);
                }
                _ => lines.push(piece.to_string()),
            }
        }
    }
    lines
}

/// Text as content or attribute value of XML and HTML; characters that XML forbids become U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            other if other.is_control() && !matches!(other, '\t' | '\n' | '\r') => {
                out.push('\u{fffd}');
            }
            other => out.push(other),
        }
    }
    out
}
