//! The invertible linear layer of a block ("1x1 convolution"), W = P L U (Kingma and Dhariwal 2018,
//! section 3.2).

use nalgebra::{DMatrix, LU, QR};
use ndarray::{Array1, Array2, ArrayD, Ix2, IxDyn};
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::prior::least;
use crate::autograd::ops::plu_product::PluFactors;
use crate::autograd::{AutogradError, BlockId, BufferId, Real, Tape, Var};
use crate::nn::Initialiser;

/// y_t = W x_t in every frame.
#[derive(Debug, Clone)]
pub struct PluLinear {
    l: BlockId,
    u: BlockId,
    log_s: BlockId,
    p: BufferId,
    sign_s: BufferId,
}

/// P, and the numbers that training moves or keeps.
struct Factors {
    p: DMatrix<f64>,
    l: DMatrix<f64>,
    u: DMatrix<f64>,
}

impl Factors {
    fn of(matrix: DMatrix<f64>) -> Self {
        let d = matrix.nrows();
        let lu = LU::new(matrix);
        let mut p = DMatrix::identity(d, d);
        lu.p().inv_permute_rows(&mut p);
        Self {
            p,
            l: lu.l(),
            u: lu.u(),
        }
    }
}

fn array<T: Real>(matrix: &DMatrix<f64>, keep: impl Fn(usize, usize) -> bool) -> ArrayD<T> {
    let (rows, columns) = matrix.shape();
    let number = |(i, j)| match keep(i, j) {
        true => T::from_f64(matrix[(i, j)]),
        false => T::zero(),
    };
    Array2::from_shape_fn((rows, columns), number).into_dyn()
}

impl PluLinear {
    /// Adds `{name}.l`, `.u [D, D]`, `.log_s [D]` and the buffers `.p [D, D]`, `.sign_s [D]`. W is
    /// `matrix` at first; without one, the Q of a Gaussian matrix's QR.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        channels: usize,
        matrix: Option<&Array2<f64>>,
    ) -> Self {
        let d = channels;
        let mut factors = None;
        let l = init.made(format!("{name}.l"), &[d, d], |rng| {
            let matrix = match matrix {
                Some(given) => DMatrix::from_fn(d, d, |i, j| given[[i, j]]),
                None => QR::new(DMatrix::from_fn(d, d, |_, _| StandardNormal.sample(rng))).q(),
            };
            let made = factors.insert(Factors::of(matrix));
            array(&made.l, |i, j| j < i)
        });
        let factors = factors.as_ref();
        let whole = |pick: fn(&Factors) -> &DMatrix<f64>, keep: fn(usize, usize) -> bool| {
            move |_: &mut R| match factors {
                Some(factors) => array(pick(factors), keep),
                None => ArrayD::zeros(IxDyn(&[d, d])),
            }
        };
        let diagonal = |number: fn(f64) -> f64| {
            move |_: &mut R| {
                let of = |i: usize| factors.map_or(0.0, |it| number(it.u[(i, i)]));
                Array1::from_iter((0..d).map(|i| T::from_f64(of(i)))).into_dyn()
            }
        };
        let u = init.made(
            format!("{name}.u"),
            &[d, d],
            whole(|it| &it.u, |i, j| j > i),
        );
        let log_s = init.made(format!("{name}.log_s"), &[d], diagonal(|x| x.abs().ln()));
        let p = init.made_buffer(format!("{name}.p"), &[d, d], whole(|it| &it.p, |_, _| true));
        let sign_s = init.made_buffer(format!("{name}.sign_s"), &[d], diagonal(f64::signum));
        Self {
            l: l.1,
            u: u.1,
            log_s: log_s.1,
            p,
            sign_s,
        }
    }

    /// The row of L U that each row of W is.
    fn rows<T: Real>(&self, tape: &Tape<'_, T>) -> Result<Vec<usize>, AutogradError> {
        let p = tape.buffer(self.p)?.view().into_dimensionality::<Ix2>();
        let p = p.map_err(|_| AutogradError::Misplaced {
            operation: "plu_product",
            what: "P is no matrix",
        })?;
        // A row without a 1 names no row, which the product refuses.
        let one = |row: ndarray::ArrayView1<'_, T>| {
            row.iter()
                .position(|&x| x == T::one())
                .unwrap_or(usize::MAX)
        };
        Ok(p.rows().into_iter().map(one).collect())
    }

    fn factors<T: Real>(&self, tape: &mut Tape<'_, T>) -> PluFactors {
        PluFactors {
            l: tape.block(self.l),
            u: tape.block(self.u),
            log_s: tape.block(self.log_s),
        }
    }

    /// `x [rows, D]` -> W x of every row, and ln |det W|, `[1]`.
    ///
    /// # Errors
    /// Other channels; a P that is no permutation.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
    ) -> Result<(Var, Var), AutogradError> {
        let rows = self.rows(tape)?;
        let signs: Vec<T> = tape.buffer(self.sign_s)?.iter().copied().collect();
        let factors = self.factors(tape);
        let matrix = tape.plu_product(factors, &rows, &signs)?;
        let y = tape.linear(x, matrix, None, false)?;
        Ok((y, tape.sum(factors.log_s)))
    }

    /// The least of log_s.
    pub fn least_log_s<T: Real>(&self, tape: &mut Tape<'_, T>) -> f64 {
        let log_s = tape.block(self.log_s);
        least(tape.values(log_s))
    }

    /// x of `y [rows, D]`: two triangular solves, f64.
    ///
    /// # Errors
    /// Other channels; a P that is no permutation; a U without an inverse.
    pub fn inverse<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        y: &Array2<f64>,
    ) -> Result<Array2<f64>, AutogradError> {
        let refused = |what| AutogradError::Misplaced {
            operation: "plu_inverse",
            what,
        };
        let rows = self.rows(tape)?;
        let signs: Vec<f64> = tape
            .buffer(self.sign_s)?
            .iter()
            .map(|&x| Real::to_f64(x))
            .collect();
        let d = rows.len();
        let factors = self.factors(tape);
        let fit = y.ncols() == d && rows.iter().all(|&row| row < d) && signs.len() == d;
        if !fit {
            return Err(refused(
                "its channels are not those of the matrix, or P is no permutation",
            ));
        }
        let of = |var: Var| {
            tape.values(var)
                .iter()
                .map(|&x| Real::to_f64(x))
                .collect::<Vec<f64>>()
        };
        let (l, u, log_s) = (of(factors.l), of(factors.u), of(factors.log_s));
        let lower = DMatrix::from_fn(d, d, |i, j| if j < i { l[i * d + j] } else { 0.0 });
        let upper = DMatrix::from_fn(d, d, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => u[i * d + j],
            std::cmp::Ordering::Equal => signs[i] * log_s[i].exp(),
            std::cmp::Ordering::Greater => 0.0,
        });
        // Column t is L U x_t.
        let mut columns = DMatrix::zeros(d, y.nrows());
        for (t, y) in y.rows().into_iter().enumerate() {
            for (&row, &y) in rows.iter().zip(y) {
                columns[(row, t)] = y;
            }
        }
        lower.solve_lower_triangular_with_diag_mut(&mut columns, 1.0);
        match upper.solve_upper_triangular_mut(&mut columns) {
            true => Ok(Array2::from_shape_fn(y.dim(), |(t, i)| columns[(i, t)])),
            false => Err(refused("U has a 0 on its diagonal")),
        }
    }
}
