//! Operations on a tape, one file each: formula, shapes, forward, backward and the check of its
//! gradient side by side.
//!
//! Shapes: `[.., k]` is any number of axes before the last. Gradients are named with a `d` before
//! the value's name.

use super::error::AutogradError;

mod abs;
mod add;
mod add_layer_norm;
mod affine;
pub mod attention;
mod attention_core;
mod broadcast;
mod clamp;
mod columns;
mod concat;
mod convolve_rows;
mod cumulative_sum;
mod div;
mod drop_path;
mod dropout;
mod exp;
mod forward_kinematics;
mod gelu;
mod joined_linear;
mod layer_norm;
mod linear;
mod ln;
mod log_softmax;
pub mod lstm_cell;
mod lstm_core;
mod lstm_gates;
mod matmul;
mod mean;
mod mul;
mod noise;
mod normalise;
mod plu;
pub mod plu_product;
mod prelu;
pub mod query_attention;
mod relative_bias;
mod reshape;
mod rows;
mod shared_attention;
mod sigmoid;
mod softmax;
mod sqrt;
mod square;
mod stack;
mod strided_rows;
mod sub;
mod sum;
mod sum_last;
mod tanh;
mod unary;
mod vector_norm;

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
mod gradient_is_that_of_central_differences {
    use crate::autograd::check::property::check;

    /// Files of this folder that are no operations.
    const OTHERS: [&str; 5] = ["mod", "attention_core", "broadcast", "lstm_core", "unary"];

    /// A test of each operation on the cases that its file draws: without them it does not compile.
    macro_rules! operations {
        ($($name:ident),* $(,)?) => {
            const OPERATIONS: &[&str] = &[$(stringify!($name)),*];

            $(
                #[test]
                fn $name() {
                    check(stringify!($name), super::$name::gradient::cases());
                }
            )*
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
        convolve_rows,
        cumulative_sum,
        div,
        drop_path,
        dropout,
        exp,
        forward_kinematics,
        gelu,
        joined_linear,
        layer_norm,
        linear,
        ln,
        log_softmax,
        lstm_cell,
        lstm_gates,
        matmul,
        mean,
        mul,
        noise,
        normalise,
        plu,
        plu_product,
        prelu,
        query_attention,
        relative_bias,
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

    #[test]
    fn of_every_file_in_the_folder() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/autograd/ops");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .expect("the folder is there")
            .map(|entry| entry.expect("readable").path())
            .filter_map(|path| path.file_stem().map(|s| s.to_string_lossy().into_owned()))
            .filter(|name| !OTHERS.contains(&name.as_str()))
            .collect();
        files.sort();
        assert_eq!(
            files, OPERATIONS,
            "each file of src/autograd/ops has a `gradient` module and its name in operations!"
        );
    }
}
