//! What can go wrong on a tape.

/// An operation that was asked for something it cannot do, or a number that is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AutogradError {
    /// The shapes of two operands do not fit.
    #[error("{operation}: shapes {left:?} and {right:?} do not fit: expected {expected}")]
    Shapes {
        operation: &'static str,
        left: Vec<usize>,
        right: Vec<usize>,
        expected: &'static str,
    },
    /// The shape of one operand does not fit an argument.
    #[error("{operation}: shape {shape:?} does not fit {argument}: expected {expected}")]
    Argument {
        operation: &'static str,
        shape: Vec<usize>,
        argument: String,
        expected: &'static str,
    },
    /// The first operation whose result holds a NaN or an infinity.
    #[error(
        "{operation} (operation {index} of the step) made a {what} in its {place} of shape {shape:?} from inputs of shapes {inputs:?}"
    )]
    NonFinite {
        operation: &'static str,
        index: usize,
        /// "NaN" or "infinity".
        what: &'static str,
        /// "value" or "gradient".
        place: &'static str,
        shape: Vec<usize>,
        inputs: Vec<Vec<usize>>,
    },
}
