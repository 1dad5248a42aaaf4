//! The figures of papers: each an SVG with a caption, its numbers as CSV beside it. One file or
//! folder a paper.

#[cfg(feature = "papers")]
pub mod li2023;
mod numbers;
#[cfg(feature = "papers")]
pub mod pan2021;
#[cfg(feature = "papers")]
pub mod pu2022;
#[cfg(feature = "papers")]
pub mod valleperez2021;

pub use numbers::Numbers;

use std::path::Path;

use super::{MotionFigure, ReportError};
use crate::counted::counted;
use crate::data::Dataset;
use crate::evaluation::TableRow;
use crate::run::{FileError, Subject, replace_file};

/// Draws the figures of a paper: a line of [`crate::models::Paper`].
pub type DrawFigures = fn(&FigureRequest<'_>) -> Result<DrawnFigures, ReportError>;

/// What figures are about.
#[derive(Clone, Copy)]
pub struct FigureRequest<'a> {
    /// The model that all figures show.
    pub subject: &'a Subject,
    /// Models to set beside it.
    pub compared: &'a [Subject],
    /// Evaluated rows of a table, for figures over several.
    pub rows: &'a [TableRow],
    /// Test clips are drawn and measured.
    pub dataset: &'a Dataset,
    /// Frames of what is shown from keyframe to keyframe [default: the paper's].
    pub length: Option<usize>,
    /// The test clip that is shown [default: the first by name that is long enough].
    pub clip: Option<&'a str>,
    /// Its first frame [default: what is shown lies in the middle].
    pub start: Option<usize>,
    /// Whether a page of the motion viewer is wanted, too.
    pub page: bool,
}

#[cfg(feature = "papers")]
impl FigureRequest<'_> {
    /// Refuses rows where no figure of the paper is over rows.
    ///
    /// # Errors
    /// There are some.
    pub fn without_rows(&self) -> Result<(), ReportError> {
        match self.rows {
            [] => Ok(()),
            _ => Err(ReportError::Refused(
                "--rows is for figures over rows of a table, of which this model's paper has none; \
                 leave it out"
                    .into(),
            )),
        }
    }
}

/// Figures, and the viewer's page where it was wanted.
pub struct DrawnFigures {
    pub figures: Vec<Figure>,
    /// Which figures there are not, and why: a sentence each.
    pub left_out: Vec<String>,
    /// HTML.
    pub page: Option<String>,
}

/// What draws the figures of a subject's paper.
///
/// # Errors
/// A model that is not in the registry, or whose paper has no figures that could be drawn.
pub fn drawing_of(subject: &Subject) -> Result<DrawFigures, ReportError> {
    let refused = |text: &str| ReportError::Refused(text.into());
    let paper = subject.config.paper();
    let paper = paper.ok_or_else(|| refused("the model is not in the registry"))?;
    let none = || {
        refused(&format!(
            "{} has no figures that could be drawn",
            paper.name
        ))
    };
    paper.figures.ok_or_else(none)
}

impl DrawnFigures {
    /// Writes all figures and the page that shows them, and says what they are about, into a
    /// folder, made where there is none.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path, about: &FigureRequest<'_>) -> Result<(), ReportError> {
        let subject = format!(
            "{} on {} of the data with digest {}.",
            about.subject.what,
            counted(about.dataset.test.len(), "test clip"),
            about.dataset.digest
        );
        std::fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
        for figure in &self.figures {
            figure.write(folder)?;
        }
        let index = index(&self.figures, &self.left_out, &subject);
        Ok(replace_file(&folder.join("index.md"), index)?)
    }
}

/// Writes the figures of several test clips, of each into a folder of its name, and a page that
/// leads there; those of one into the folder itself.
///
/// # Errors
/// A file cannot be written.
pub fn write_all(
    folder: &Path,
    drawn: &[(FigureRequest<'_>, DrawnFigures)],
) -> Result<(), ReportError> {
    if let [(about, figures)] = drawn {
        return figures.write(folder, about);
    }
    let mut text = "# The paper's figures, by test clip\n\n".to_string();
    for (about, figures) in drawn {
        let clip = about.clip.unwrap_or_default();
        let name = Path::new(clip).file_stem().unwrap_or_default();
        figures.write(&folder.join(name), about)?;
        let name = name.to_string_lossy();
        text += &format!("- [{name}](<{name}/index.md>)\n");
    }
    Ok(replace_file(&folder.join("index.md"), text)?)
}

/// A figure and the numbers behind it.
pub struct Figure {
    /// File name without extension, such as `figure_8`.
    pub name: &'static str,
    /// One line: what the figure shows and what was measured.
    pub caption: String,
    pub svg: String,
    pub numbers: Numbers,
}

impl Figure {
    /// A figure of dancers, with its caption.
    ///
    /// # Errors
    /// There is nothing that could be drawn.
    pub fn of_dancers(
        name: &'static str,
        drawing: MotionFigure,
        numbers: Numbers,
    ) -> Result<Self, ReportError> {
        Ok(Self {
            name,
            svg: drawing.svg()?,
            caption: drawing.caption,
            numbers,
        })
    }

    /// Writes the SVG and the CSV.
    ///
    /// # Errors
    /// A file cannot be written.
    fn write(&self, folder: &Path) -> Result<(), ReportError> {
        let path = |extension: &str| folder.join(self.name).with_extension(extension);
        replace_file(&path("svg"), &self.svg)?;
        replace_file(&path("csv"), &self.numbers.csv()?)?;
        Ok(())
    }
}

/// The page that shows all figures with their captions, Markdown.
fn index(figures: &[Figure], left_out: &[String], subject: &str) -> String {
    let mut text = format!("# The paper's figures\n\n{subject}\n");
    for Figure { name, caption, .. } in figures {
        let caption = caption.replace('[', "(").replace(']', ")");
        text +=
            &format!("\n![{caption}]({name}.svg)\n\n{caption} Numbers: [{name}.csv]({name}.csv)\n");
    }
    for sentence in left_out {
        text += &format!("\n{sentence}\n");
    }
    text
}
