//! Training: curriculum, scheduled sampling, the loop, checkpoints.
