//! f32 products as a walk over tiles of C, each computed by one kernel in registers.
//!
//! The order of the sums: k is cut into blocks by k alone, each element of C is one chain of fused
//! multiply-adds over a block, and the blocks are added up in turn. So an element has the same bits
//! whatever other rows and columns are in the call, packed or not, and on every set of kernels.

use std::cell::RefCell;

use super::{MatMut, buffer::Buffer, matrix::Operand, vectorised};

/// Rows of a packed block of A, filled up: the distance between its columns.
pub const LEFT_STEP: usize = 16;
/// Most of k in a block: a block of A stays in the first-level cache.
const DEPTH: usize = 256;
/// Columns of B in a group: depth by group stays in the second-level cache.
const GROUP: usize = 512;
/// Up to this many rows, A is read where it is.
const FEW_ROWS: usize = 3;
/// Up to this many rows, an operand B that is not packed is read where it is.
const SOME_ROWS: usize = 28;

/// One product of rows of A and columns of B, the work of a kernel.
///
/// Element `(i, p)` of A is at `a[i * a_row + p]` for direct kernels and at `a[i + p * LEFT_STEP]`
/// for the others, element `(p, j)` of panel q of B at `b[q * b_panel + p * b_step + j]`, element
/// `(i, j)` of C at `c[i * c_row + j]`.
#[derive(Clone, Copy)]
pub struct Tile {
    pub k: usize,
    pub a: *const f32,
    pub a_row: usize,
    pub b: *const f32,
    pub b_step: usize,
    pub b_panel: usize,
    pub c: *mut f32,
    pub c_row: usize,
    pub cols: usize,
    pub accumulate: bool,
}

/// A kernel: C (+)= A B on a tile.
///
/// # Safety
/// The CPU has the kernel's instruction set. All of A's rows, B's whole panels (`cols` beyond the
/// last but one) and C's `cols` columns are valid, and C overlaps nothing else.
pub type Kernel = unsafe fn(&Tile);

/// Kernels for one number of rows.
pub struct Rows {
    /// Panels that `wide` takes.
    pub panels: usize,
    /// Several panels at once, to have enough independent sums with few rows.
    pub wide: Kernel,
    /// One panel.
    pub single: Kernel,
    /// The first half of a panel.
    pub half: Kernel,
    /// `wide` for A where it is.
    pub wide_direct: Kernel,
    /// `single` for A where it is.
    pub single_direct: Kernel,
    /// `half` for A where it is.
    pub half_direct: Kernel,
}

/// [`Rows`] of an instruction set's `tile`s: numbers of rows, each times the panels of the wide
/// one.
macro_rules! rows {
    ($($rows:literal * $panels:literal),*) => {
        &[$(Rows {
            panels: $panels,
            wide: tile::<$rows, $panels, 2, false>,
            single: tile::<$rows, 1, 2, false>,
            half: tile::<$rows, 1, 1, false>,
            wide_direct: tile::<$rows, $panels, 2, true>,
            single_direct: tile::<$rows, 1, 2, true>,
            half_direct: tile::<$rows, 1, 1, true>,
        }),*]
    };
}
pub(super) use rows;

/// The kernels of an instruction set.
pub struct Kernels {
    /// Columns of a panel.
    pub width: usize,
    /// By number of rows less one.
    pub rows: &'static [Rows],
    /// Writes the transpose of a matrix.
    pub transpose: Transpose,
}

/// `to[c * width + r] = from[r * stride + c]`, and 0 for r from `rows` to `width`.
///
/// Arguments: from, stride, rows, columns, to, width; width is a multiple of 8.
///
/// # Safety
/// The CPU has the function's instruction set; all elements named are valid.
pub type Transpose = unsafe fn(*const f32, usize, usize, usize, *mut f32, usize);

/// Memory that products on this thread use again.
struct Scratch {
    left: Buffer<f32>,
    right: Buffer<f32>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> =
        const { RefCell::new(Scratch { left: Buffer::new(), right: Buffer::new() }) };
}

/// Lays B `[k, n]` out in panels.
pub fn pack(kernels: &Kernels, b: Operand<f32>, packed: &mut Buffer<f32>) {
    let (k, n) = (b.rows(), b.cols());
    let to = packed.resized(n.div_ceil(kernels.width) * kernels.width * k);
    pack_panels(kernels, b, 0..k, 0..n, to);
}

/// Writes a range of rows and columns of B into panels.
fn pack_panels(
    kernels: &Kernels,
    b: Operand<f32>,
    depth: std::ops::Range<usize>,
    cols: std::ops::Range<usize>,
    to: &mut [f32],
) {
    if depth.is_empty() {
        return;
    }
    let width = kernels.width;
    let panels = to.chunks_exact_mut(width * depth.len());
    for (first, panel) in cols.clone().step_by(width).zip(panels) {
        let valid = width.min(cols.end - first);
        if b.transposed {
            transpose(
                kernels,
                b,
                first..first + valid,
                depth.clone(),
                panel,
                width,
            );
        } else if width == 32 {
            copy_rows::<32>(b, depth.clone(), first..first + valid, panel);
        } else {
            copy_rows::<16>(b, depth.clone(), first..first + valid, panel);
        }
    }
}

/// Copies a block of a matrix as it lies in memory to rows of `W`, filled up with zeros.
fn copy_rows<const W: usize>(
    from: Operand<f32>,
    rows: std::ops::Range<usize>,
    cols: std::ops::Range<usize>,
    to: &mut [f32],
) {
    let (data, stride) = (from.matrix.data, from.matrix.stride);
    vectorised(
        #[inline(always)]
        || {
            for (row, to) in rows.zip(to.as_chunks_mut::<W>().0) {
                let from = &data[row * stride + cols.start..];
                match from.first_chunk::<W>() {
                    Some(whole) if cols.len() == W => *to = *whole,
                    _ => {
                        to.fill(0.0);
                        to[..cols.len()].copy_from_slice(&from[..cols.len()]);
                    }
                }
            }
        },
    );
}

/// Writes the transpose of a block of a matrix as it lies in memory.
fn transpose(
    kernels: &Kernels,
    from: Operand<f32>,
    rows: std::ops::Range<usize>,
    cols: std::ops::Range<usize>,
    to: &mut [f32],
    width: usize,
) {
    let (data, stride) = (from.matrix.data, from.matrix.stride);
    let from = &data[rows.start * stride + cols.start..];
    assert!((rows.len() - 1) * stride + cols.len() <= from.len());
    assert!(rows.len() <= width && width.is_multiple_of(8) && cols.len() * width <= to.len());
    // SAFETY: the block lies within both slices; `kernels` are of a set that this CPU has.
    unsafe {
        (kernels.transpose)(
            from.as_ptr(),
            stride,
            rows.len(),
            cols.len(),
            to.as_mut_ptr(),
            width,
        );
    }
}

/// Writes a block of A as columns of `LEFT_STEP` numbers.
fn pack_left(
    kernels: &Kernels,
    a: Operand<f32>,
    rows: std::ops::Range<usize>,
    depth: std::ops::Range<usize>,
    to: &mut [f32],
) {
    if a.transposed {
        // Whole steps where memory goes on behind the block: what is too much is never read.
        let data = a.matrix.data;
        vectorised(
            #[inline(always)]
            || {
                for (p, to) in depth.zip(to.as_chunks_mut::<LEFT_STEP>().0) {
                    let from = &data[p * a.matrix.stride + rows.start..];
                    match from.first_chunk::<LEFT_STEP>() {
                        Some(whole) => *to = *whole,
                        None => to[..rows.len()].copy_from_slice(&from[..rows.len()]),
                    }
                }
            },
        );
    } else {
        transpose(kernels, a, rows, depth, to, LEFT_STEP);
    }
}

/// C (+)= A B.
pub fn product(
    kernels: &Kernels,
    a: Operand<f32>,
    b: Operand<f32>,
    c: MatMut<f32>,
    accumulate: bool,
) {
    multiply(kernels, a, Right::Plain(b), c, accumulate);
}

/// C (+)= A B with B as [`pack`] left it.
pub fn product_packed(
    kernels: &Kernels,
    a: Operand<f32>,
    b: &[f32],
    c: MatMut<f32>,
    accumulate: bool,
) {
    multiply(kernels, a, Right::Panels(b), c, accumulate);
}

/// The right operand.
enum Right<'a> {
    Panels(&'a [f32]),
    Plain(Operand<'a, f32>),
}

/// Columns of B in panels: where they start, and the distances between rows and between panels.
#[derive(Clone, Copy)]
struct Columns {
    start: *const f32,
    step: usize,
    panel: usize,
}

/// A range cut into `count` parts that differ by one at most.
fn parts(len: usize, count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    (0..count).map(move |i| len * i / count..len * (i + 1) / count)
}

fn multiply(kernels: &Kernels, a: Operand<f32>, b: Right, c: MatMut<f32>, accumulate: bool) {
    let (m, k, n) = (a.rows(), a.cols(), c.cols);
    if m == 0 || n == 0 {
        return;
    }
    if k == 0 {
        if !accumulate {
            (0..m).for_each(|i| c.data[i * c.stride..][..n].fill(0.0));
        }
        return;
    }
    let width = kernels.width;
    if let Right::Panels(data) = b {
        assert!(n.div_ceil(width) * width * k <= data.len());
    }
    let a_row = a.matrix.stride;
    let direct = m <= FEW_ROWS && !a.transposed;
    SCRATCH.with_borrow_mut(|scratch| {
        let left = scratch.left.at_least(DEPTH * LEFT_STEP);
        for first in (0..n).step_by(GROUP) {
            let cols = first..n.min(first + GROUP);
            for depth in parts(k, k.div_ceil(DEPTH)) {
                // Columns in whole panels of one layout, then the rest.
                let (parted, columns) = match b {
                    Right::Panels(data) => {
                        let start = first / width * width * k + depth.start * width;
                        let start = data[start..].as_ptr();
                        (
                            cols.len(),
                            [Columns {
                                start,
                                step: width,
                                panel: width * k,
                            }; 2],
                        )
                    }
                    Right::Plain(b) => {
                        let direct = !b.transposed && m <= SOME_ROWS;
                        let parted = if direct {
                            cols.len() / width * width
                        } else {
                            0
                        };
                        let rest = cols.start + parted..cols.end;
                        let len = rest.len().div_ceil(width) * width * depth.len();
                        let to = scratch.right.at_least(len);
                        pack_panels(kernels, b, depth.clone(), rest, to);
                        let panel = width * depth.len();
                        let rest = Columns {
                            start: to.as_ptr(),
                            step: width,
                            panel,
                        };
                        let step = b.matrix.stride;
                        let start = b.matrix.data.as_ptr();
                        let start = start.wrapping_add(depth.start * step + first);
                        (
                            parted,
                            [
                                Columns {
                                    start,
                                    step,
                                    panel: width,
                                },
                                rest,
                            ],
                        )
                    }
                };
                for rows in parts(m, m.div_ceil(kernels.rows.len())) {
                    let (start, row) = if direct {
                        (
                            a.matrix.data[rows.start * a_row + depth.start..].as_ptr(),
                            a_row,
                        )
                    } else {
                        pack_left(kernels, a, rows.clone(), depth.clone(), left);
                        (left.as_ptr(), 1)
                    };
                    let starts = [(0, parted), (parted, cols.len() - parted)];
                    for (columns, (from, cols)) in columns.iter().zip(starts) {
                        if cols == 0 {
                            continue;
                        }
                        let tile = Tile {
                            k: depth.len(),
                            a: start,
                            a_row: row,
                            b: columns.start,
                            b_step: columns.step,
                            b_panel: columns.panel,
                            c: c.data[rows.start * c.stride + first + from..].as_mut_ptr(),
                            c_row: c.stride,
                            cols,
                            accumulate: accumulate || depth.start > 0,
                        };
                        // SAFETY: A's rows and depth, B's panels and C's rows and columns lie
                        // within their slices; C is borrowed exclusively; `kernels` fit this CPU.
                        unsafe { sweep(kernels, rows.len(), tile, direct) };
                    }
                }
            }
        }
    });
}

/// Runs kernels over the columns of `tile`.
///
/// # Safety
/// As for a [`Kernel`], with as many panels as `cols` need.
unsafe fn sweep(kernels: &Kernels, rows: usize, mut tile: Tile, direct: bool) {
    let width = kernels.width;
    let of = &kernels.rows[rows - 1];
    let (wide, single, half) = if direct {
        (of.wide_direct, of.single_direct, of.half_direct)
    } else {
        (of.wide, of.single, of.half)
    };
    let mut left = tile.cols;
    while left > 0 {
        let (kernel, panels) = if left > (of.panels - 1) * width + width / 2 {
            (wide, of.panels)
        } else if left > width / 2 {
            (single, 1)
        } else {
            (half, 1)
        };
        tile.cols = left.min(panels * width);
        // SAFETY: the panels and columns from here on are part of what the caller vouches for;
        // pointers past the last panel are made but never read.
        unsafe { kernel(&tile) };
        left -= tile.cols;
        tile.b = tile.b.wrapping_add(panels * tile.b_panel);
        tile.c = tile.c.wrapping_add(panels * width);
    }
}
