//! Named random streams.

use std::collections::HashSet;

use keydance::models::Streams;
use rand::Rng as _;

#[test]
fn every_name_and_index_has_a_stream_of_its_own() {
    let mut firsts = HashSet::new();
    for seed in 0..3 {
        let streams = Streams::new(seed);
        assert!(firsts.insert(streams.initialisation().next_u64()));
        for index in 0..4 {
            for name in ["shuffling", "sampling", "mirroring"] {
                assert!(firsts.insert(streams.stream(name, &[index]).next_u64()));
            }
            for shard in 0..4 {
                assert!(firsts.insert(streams.dropout(index, shard)));
            }
        }
    }
}

#[test]
fn a_stream_is_the_same_on_every_machine() {
    // Recorded: a change of it changes every trained model.
    assert_eq!(Streams::new(7).dropout(2, 1), 2_358_994_433_055_209_379);
}
