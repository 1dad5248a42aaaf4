//! Operations on a tape, one file each: formula, shapes, forward, backward and the check of its gradient side by side.
//!
//! Shapes: `[.., k]` is any number of axes before the last. Gradients are named with a `d` before the value's name.

use super::error::AutogradError;

mod broadcast;
pub mod unary;

/// Declares the operations: a file that is not named here is not built, and one whose tests do not draw cases
/// (`cases()` in its `gradient` module) does not compile under test.
macro_rules! operations {
    ($($name:ident),* $(,)?) => {
        $(pub mod $name;)*

        /// Names of all operations.
        pub const OPERATIONS: &[&str] = &[$(stringify!($name)),*];

        #[cfg(test)]
        mod gradient_is_that_of_central_differences {
            $(
                #[test]
                fn $name() {
                    let cases = super::$name::gradient::cases();
                    crate::autograd::check::property::check(stringify!($name), cases);
                }
            )*
        }
    };
}

operations!(
    abs,
    add,
    add_layer_norm,
    affine,
    attention,
    clamp,
    columns,
    concat,
    dropout,
    exp,
    forward_kinematics,
    layer_norm,
    linear,
    lstm_cell,
    matmul,
    mul,
    noise,
    normalise,
    plu,
    prelu,
    query_attention,
    relu,
    reshape,
    rows,
    shared_attention,
    sigmoid,
    softmax,
    sqrt,
    square,
    stack,
    strided_rows,
    sub,
    sum,
    sum_last,
    tanh,
    vector_norm,
);

fn shapes_error(
    operation: &'static str,
    left: &[usize],
    right: &[usize],
    expected: &'static str,
) -> AutogradError {
    AutogradError::Shapes {
        operation,
        left: left.to_vec(),
        right: right.to_vec(),
        expected,
    }
}

fn argument_error(
    operation: &'static str,
    shape: &[usize],
    argument: String,
    expected: &'static str,
) -> AutogradError {
    AutogradError::Argument {
        operation,
        shape: shape.to_vec(),
        argument,
        expected,
    }
}

#[cfg(test)]
mod registry {
    /// Helpers in this folder that are no operations.
    const OTHERS: [&str; 3] = ["mod", "broadcast", "unary"];

    #[test]
    fn every_file_of_the_folder_is_a_registered_operation() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/autograd/ops");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .expect("the folder is there")
            .map(|entry| entry.expect("readable").path())
            .filter_map(|path| path.file_stem().map(|s| s.to_string_lossy().into_owned()))
            .filter(|name| !OTHERS.contains(&name.as_str()))
            .collect();
        files.sort();
        assert_eq!(files, super::OPERATIONS);
    }
}
