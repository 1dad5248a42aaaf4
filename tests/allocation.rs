//! After the first steps a training step allocates nothing large: its buffers are those of the step
//! before.
//!
//! A program of its own, because its allocator counts what all threads of the process allocate.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::models::pan2021::{Controllers, Pan2021, Pan2021Config};
use keydance::models::transition::gradient_check::generated_batch;
use keydance::models::transition::{Batch, Forcing, Network};
use keydance::nn::Initialiser;
use keydance::optim::{Adam, AdamConfig};
use ndarray::s;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Bytes from which an allocation counts as large.
const LARGE: usize = 64 << 10;

/// Held while steps are counted: the allocations are those of all threads.
static COUNTING: Mutex<()> = Mutex::new(());

/// Bytes of all large allocations so far.
static LARGE_BYTES: AtomicUsize = AtomicUsize::new(0);

struct Counting;

fn count(bytes: usize) {
    if bytes > LARGE {
        LARGE_BYTES.fetch_add(bytes, Ordering::Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        // SAFETY: as the caller promised.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A training step on some windows of 12 frames: bytes of its large allocations, and the numbers
/// that the workspace holds after it.
struct Step {
    large_bytes: usize,
    held: usize,
}

/// Steps on batches of these numbers of windows.
fn steps(config: &Pan2021Config, forcing: Forcing, windows: &[usize]) -> Vec<Step> {
    let _counting = COUNTING.lock().unwrap();
    let most = windows.iter().copied().max().unwrap();
    let (whole, standardisation) = generated_batch(12, most, 3).unwrap();
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(1));
    let network = Pan2021::new(&mut init, config, &standardisation).unwrap();
    let batches: Vec<_> = windows
        .iter()
        .map(|&windows| {
            let features = whole.features.slice(s![.., ..windows, ..]);
            Batch::of(features.mapv(|x| x as f32))
        })
        .collect();
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    let mut adam = Adam::new(AdamConfig::default(), &parameters).unwrap();
    let steps = batches.iter().enumerate().map(|(step, batch)| {
        let before = LARGE_BYTES.load(Ordering::Relaxed);
        let mut tape = Tape::recording(&parameters, &mut workspace).with_dropout(step as u64);
        let total = network.losses(&mut tape, batch, forcing).unwrap().total;
        tape.backward(total, &mut gradients).unwrap();
        adam.step(&mut parameters, &mut gradients).unwrap();
        Step {
            large_bytes: LARGE_BYTES.load(Ordering::Relaxed) - before,
            held: workspace.held(),
        }
    });
    steps.collect()
}

fn small_model() -> Pan2021Config {
    Pan2021Config {
        hidden: 64,
        code: 32,
        heads: 4,
        feed_forward: 48,
        ..Pan2021Config::default()
    }
}

#[test]
fn a_training_step_allocates_nothing_large_after_the_first_two() {
    let condition_fc = Pan2021Config {
        controllers: Controllers::FullyConnected,
        ..small_model()
    };
    for config in [small_model(), condition_fc] {
        for forcing in [Forcing::FreeRunning, Forcing::Teacher] {
            let steps = steps(&config, forcing, &[32; 5]);
            let bytes: Vec<usize> = steps.iter().map(|step| step.large_bytes).collect();
            assert!(
                bytes[0] > LARGE,
                "the first step fills the workspace: {bytes:?}"
            );
            assert_eq!(bytes[2..], [0, 0, 0], "{forcing:?}: {bytes:?}");
        }
    }
}

#[test]
fn batches_of_changing_sizes_share_their_buffers() {
    let of_one_size = steps(&small_model(), Forcing::FreeRunning, &[32; 3]);
    let sizes = [32, 16, 9, 13, 4, 25, 32, 7, 11, 20];
    let changing = steps(&small_model(), Forcing::FreeRunning, &sizes);
    let (one, all) = (of_one_size[2].held, changing[sizes.len() - 1].held);
    // Without sharing about the sum of the sizes over the largest one, 5 times.
    assert!(all < 2 * one, "{all} numbers against {one}");
}
