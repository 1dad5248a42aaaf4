//! Ranks that are threads of one process.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Barrier, Mutex};

use keydance::ranks::Ranks;

/// What all ranks see.
struct Room {
    barrier: Barrier,
    said: Mutex<Vec<Vec<u8>>>,
    values: Mutex<Vec<f32>>,
}

/// A rank that is a thread.
pub struct Thread {
    pub rank: usize,
    room: Arc<Room>,
    to: Mutex<HashMap<usize, Sender<Vec<f32>>>>,
    from: Mutex<HashMap<usize, Receiver<Vec<f32>>>>,
}

impl Ranks for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.room.said.lock().unwrap().len()
    }

    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        self.room.said.lock().unwrap()[self.rank] = own.to_vec();
        self.room.barrier.wait();
        let all = self.room.said.lock().unwrap().clone();
        self.room.barrier.wait();
        all
    }

    fn broadcast(&self, values: &mut [f32], from: usize) {
        if self.rank == from {
            *self.room.values.lock().unwrap() = values.to_vec();
        }
        self.room.barrier.wait();
        values.copy_from_slice(&self.room.values.lock().unwrap());
        self.room.barrier.wait();
    }

    fn send(&self, values: &[f32], to: usize) {
        self.to.lock().unwrap()[&to].send(values.to_vec()).unwrap();
    }

    fn receive(&self, values: &mut [f32], from: usize) {
        values.copy_from_slice(&self.from.lock().unwrap()[&from].recv().unwrap());
    }
}

fn ranks(count: usize) -> Vec<Arc<Thread>> {
    let room = Arc::new(Room {
        barrier: Barrier::new(count),
        said: Mutex::new(vec![Vec::new(); count]),
        values: Mutex::default(),
    });
    let mut to: Vec<HashMap<_, _>> = (0..count).map(|_| HashMap::new()).collect();
    let mut from: Vec<HashMap<_, _>> = (0..count).map(|_| HashMap::new()).collect();
    for (sends, sender) in to.iter_mut().enumerate() {
        for (receives, receiver) in from.iter_mut().enumerate() {
            let (into, out) = channel();
            sender.insert(receives, into);
            receiver.insert(sends, out);
        }
    }
    let ends = to.into_iter().zip(from).enumerate();
    let rank = |(rank, (to, from))| {
        Arc::new(Thread {
            rank,
            room: Arc::clone(&room),
            to: Mutex::new(to),
            from: Mutex::new(from),
        })
    };
    ends.map(rank).collect()
}

/// What each rank makes of it.
pub fn on_each<R: Send>(count: usize, act: impl Fn(Arc<Thread>) -> R + Sync) -> Vec<R> {
    std::thread::scope(|scope| {
        let act = &act;
        let threads = ranks(count).into_iter();
        let threads: Vec<_> = threads.map(|rank| scope.spawn(move || act(rank))).collect();
        let ended = threads.into_iter().map(|thread| thread.join().unwrap());
        ended.collect()
    })
}
