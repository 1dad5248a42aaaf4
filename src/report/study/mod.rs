//! The user study of Valle-Pérez et al. (2021), section 5.2: clips of several models' dances, rated
//! from 1 to 5 by people who do not know whose they see.
//!
//! [`StudyRequest::make`] makes the page and the key of it, [`read_ratings`] reads what the page
//! saved, [`StudyAnalysis`] says what it means. Nothing here knows how a dance was made.

mod analysis;
mod error;
mod key;
mod page;
mod question;
mod ratings;
mod request;
mod stimuli;
mod table;

pub use analysis::{
    Comparison, ModelRatings, Pair, QuestionAnalysis, StudyAnalysis, Untested, VarianceAnalysis,
};
pub use error::StudyError;
pub use key::{StudyClip, StudyKey, StudyModel};
pub use question::Question;
pub use ratings::{Rating, read_ratings};
pub use request::{Study, StudyRequest};
