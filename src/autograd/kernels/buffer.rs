//! Memory for packed operands, aligned to cache lines.

/// Numbers in a line; a multiple of 64 bytes for f32 and f64.
const LINE: usize = 16;

/// Consecutive numbers that start where a cache line starts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line<T>([T; LINE]);

/// A growing block of numbers that starts where a cache line starts.
#[derive(Clone, Debug)]
pub struct Buffer<T> {
    lines: Vec<Line<T>>,
}

impl<T: Copy + Default> Buffer<T> {
    /// A buffer without memory.
    pub const fn new() -> Self {
        Self { lines: Vec::new() }
    }

    /// At least `len` numbers (whole lines), of any value; what is there already is used again.
    pub fn resized(&mut self, len: usize) -> &mut [T] {
        self.lines
            .resize(len.div_ceil(LINE), Line([T::default(); LINE]));
        self.as_mut_slice()
    }

    /// At least `len` numbers, of any value; never shrinks.
    pub fn at_least(&mut self, len: usize) -> &mut [T] {
        if self.lines.len() * LINE < len {
            return self.resized(len);
        }
        self.as_mut_slice()
    }

    /// All numbers.
    pub fn as_slice(&self) -> &[T] {
        // SAFETY: a line is `LINE` numbers in C layout without padding, as its size, LINE * 4 or
        // LINE * 8 bytes, is a multiple of its alignment.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.lines.len() * LINE) }
    }

    fn as_mut_slice(&mut self) -> &mut [T] {
        const { assert!(size_of::<Line<T>>() == LINE * size_of::<T>()) };
        let len = self.lines.len() * LINE;
        // SAFETY: as in `as_slice`; borrowed exclusively.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), len) }
    }
}
