//! After the first steps a training step allocates nothing large: its buffers are those of the step before.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
use keydance::models::gradient_check::generated_windows;
use keydance::models::pan2021::{Controllers, Pan2021, Pan2021Config};
use keydance::models::{Batch, Feed, Network};
use keydance::nn::Initialiser;
use keydance::optim::{Adam, AdamConfig};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Bytes from which an allocation counts as large.
const LARGE: usize = 64 << 10;

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

/// Bytes of large allocations in each of some training steps on 32 windows of 12 frames.
fn large_bytes_by_step(config: &Pan2021Config, feed: Feed) -> Vec<usize> {
    let windows = 32;
    let (features, standardisation) = generated_windows(12, windows, 3).unwrap();
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, ChaCha8Rng::seed_from_u64(1));
    let network = Pan2021::new(&mut init, config, &standardisation).unwrap();
    let batch = Batch::of(features.mapv(|x| x as f32));
    let mut workspace = Workspace::new();
    let mut gradients = [Gradients::zeros(&parameters)];
    let mut adam = Adam::new(AdamConfig::default(), &parameters);
    let steps = (0..5).map(|step| {
        let before = LARGE_BYTES.load(Ordering::Relaxed);
        let mut tape = Tape::recording(&parameters, &mut workspace).with_dropout(step);
        let total = network.losses(&mut tape, &batch, feed).unwrap().total;
        tape.backward(total, &mut gradients[0]).unwrap();
        adam.step(&mut parameters, &mut gradients, 1e-4).unwrap();
        LARGE_BYTES.load(Ordering::Relaxed) - before
    });
    steps.collect()
}

#[test]
fn a_training_step_allocates_nothing_large_after_the_first_two() {
    let whole_model = Pan2021Config {
        hidden: 64,
        code: 32,
        heads: 4,
        feed_forward: 48,
        ..Pan2021Config::default()
    };
    let condition_fc = Pan2021Config {
        controllers: Controllers::FullyConnected,
        ..whole_model.clone()
    };
    for config in [whole_model, condition_fc] {
        for feed in [Feed::Predictions, Feed::GroundTruth] {
            let bytes = large_bytes_by_step(&config, feed);
            assert!(
                bytes[0] > LARGE,
                "the first step fills the workspace: {bytes:?}"
            );
            assert_eq!(bytes[2..], [0, 0, 0], "{feed:?}: {bytes:?}");
        }
    }
}
