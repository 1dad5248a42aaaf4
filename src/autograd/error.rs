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
    /// A number that is given beside the operands is out of its range.
    #[error("{operation}: {name} = {value}: expected {expected}")]
    Number {
        operation: &'static str,
        name: &'static str,
        value: f64,
        expected: &'static str,
    },
    /// What is given belongs elsewhere, or the tape cannot do it.
    #[error("{operation}: {what}")]
    Misplaced {
        operation: &'static str,
        what: &'static str,
    },
    /// What a step is computed from is not to be had: why.
    #[error("{0}")]
    Input(String),
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

impl AutogradError {
    /// An error about the number `name` of an operation unless it is `valid`.
    pub(crate) fn unless(
        valid: bool,
        operation: &'static str,
        (name, value): (&'static str, f64),
        expected: &'static str,
    ) -> Result<(), Self> {
        match valid {
            true => Ok(()),
            false => Err(Self::Number {
                operation,
                name,
                value,
                expected,
            }),
        }
    }
}
