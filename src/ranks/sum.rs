//! The sum of all shards' gradients in the shards' order, on every rank.
//!
//! A sum of floating-point numbers depends on its order, so partial sums go from rank to rank: each
//! adds its shards to what the ranks before it have added, part by part, so that all are at work.
//! The last has the sum, and gives it to all. A rank sends twice the gradient at most.

use super::Ranks;
use crate::autograd::Gradients;

/// Numbers of a part.
const PART: usize = 1 << 16;

/// Gives the numbers of a run of the values, which lie in several slices, to `each` in turn.
fn stretch<'v>(
    values: impl Iterator<Item = &'v mut [f32]>,
    start: usize,
    len: usize,
    mut each: impl FnMut(&mut [f32], usize),
) {
    let (mut before, end) = (0, start + len);
    for slice in values {
        let (from, to) = (before.max(start), (before + slice.len()).min(end));
        if from < to {
            each(&mut slice[from - before..to - before], from - start);
        }
        before += slice.len();
        if before >= end {
            break;
        }
    }
}

/// Leaves the sum over the first `active` ranks' gradients, which are of shards in their order, in
/// the first of them; zeros in the others. Returns the bytes that this rank sent.
pub(super) fn sum_in_order(ranks: &dyn Ranks, active: usize, own: &mut [Gradients<f32>]) -> u64 {
    let Some((first, rest)) = own.split_first_mut() else {
        return 0;
    };
    let (rank, last) = (ranks.rank(), active.saturating_sub(1));
    let total: usize = first.iter().map(<[f32]>::len).sum();
    let (mut part, mut sent) = (vec![0.0; PART.min(total)], 0);
    let mut start = 0;
    while rank <= last && start < total {
        let part = &mut part[..PART.min(total - start)];
        let mut begun = rank > 0;
        if begun {
            ranks.receive(part, rank - 1);
        }
        for shard in std::iter::once(&mut *first).chain(rest.iter_mut()) {
            stretch(shard.iter_mut(), start, part.len(), |own, at| {
                let sums = part[at..at + own.len()].iter_mut().zip(own);
                match begun {
                    true => sums.for_each(|(sum, own)| *sum += *own),
                    false => sums.for_each(|(sum, own)| *sum = *own),
                }
            });
            begun = true;
        }
        if rank < last {
            ranks.send(part, rank + 1);
            sent += 4 * part.len() as u64;
        } else {
            stretch(first.iter_mut(), start, part.len(), |own, at| {
                own.copy_from_slice(&part[at..at + own.len()]);
            });
        }
        start += part.len();
    }
    rest.iter_mut().for_each(Gradients::set_zero);
    for values in first.iter_mut() {
        ranks.broadcast(values, last);
    }
    if rank == last && ranks.count() > 1 {
        sent += 4 * total as u64;
    }
    sent
}
