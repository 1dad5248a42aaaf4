//! An operation of one's own, softplus, with its way back, and the check of its gradient:
//! `cargo test --example custom_operation --features proptest`.

use keydance::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};
use keydance::autograd::{Gradients, Parameters, Workspace};

struct Softplus {
    x: Var,
}

impl<T: Real> Operation<T> for Softplus {
    /// dX = dY / (1 + e^-x).
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let x = context.values(self.x);
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i] / (T::one() + (-x[i]).exp()));
        }
    }
}

/// ln(1 + e^x), elementwise.
fn softplus<T: Real>(tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
    let y = tape
        .array(x)
        .mapv(|x| x.max(T::zero()) + (-x.abs()).exp().ln_1p());
    tape.record("softplus", &[x], y, || Softplus { x })
}

fn main() -> Result<(), AutogradError> {
    let parameters = Parameters::<f64>::new();
    let mut workspace = Workspace::new();
    let mut tape = Tape::recording(&parameters, &mut workspace);
    let x = tape.input(ndarray::arr1(&[-2.0, 0.0, 3.0]));
    let y = softplus(&mut tape, x)?;
    let twice = tape.affine(y, 2.0, 0.0);
    println!("softplus {:.4}", tape.array(y));
    // Gradients of any value: of what was given, and of what was computed on the way.
    let mut gradients = Gradients::zeros(&parameters);
    let found = tape.backward_from(twice, &[1.0; 3], &[x, y], &mut gradients)?;
    println!("of x {:.4}, of softplus {:.4}", found[0], found[1]);
    Ok(())
}

#[cfg(all(test, feature = "proptest"))]
mod tests {
    use keydance::autograd::check::property;

    #[test]
    fn the_gradient_of_softplus_is_that_of_central_differences() {
        property::check("softplus", property::of_one_value(0.0, super::softplus));
    }
}
