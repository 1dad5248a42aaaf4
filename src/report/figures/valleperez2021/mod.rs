//! Figures of Valle-Perez et al., from numbers.

pub mod tempograms;
