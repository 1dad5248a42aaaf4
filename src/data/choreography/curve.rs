//! Curves over time through keys, without overshoot, and smoothing.

/// Keys closer together than this (frames) are one key.
const CLOSEST_KEYS: f64 = 1.0;

/// A curve of `K` numbers over frames, given by keys in the order of time.
#[derive(Debug, Clone)]
pub struct Track<const K: usize> {
    keys: Vec<(f64, [f64; K])>,
}

impl<const K: usize> Track<K> {
    /// A curve that stays at `value` until the next key.
    pub fn new(value: [f64; K]) -> Self {
        Self {
            keys: vec![(0.0, value)],
        }
    }

    /// Adds a key; keys after it, and nearer before it than a frame, give way to it.
    pub fn key(&mut self, frame: f64, value: [f64; K]) {
        let near = frame - CLOSEST_KEYS;
        while self.keys.last().is_some_and(|(last, _)| *last > near) {
            self.keys.pop();
        }
        self.keys.push((frame, value));
    }

    /// Holds the last value until `frame`, where its key lies before.
    pub fn hold(&mut self, frame: f64) {
        if self
            .keys
            .last()
            .is_some_and(|(last, _)| *last + CLOSEST_KEYS <= frame)
        {
            self.key(frame, self.last());
        }
    }

    /// The value of the last key.
    pub fn last(&self) -> [f64; K] {
        self.keys.last().map_or([0.0; K], |(_, value)| *value)
    }

    /// The curve at frame `t`: cubic Hermite pieces whose slopes never overshoot the keys (Fritsch
    /// and Carlson 1980).
    pub fn at(&self, t: f64) -> [f64; K] {
        let after = self.keys.partition_point(|(frame, _)| *frame <= t);
        if after == 0 {
            return self.keys.first().map_or([0.0; K], |(_, value)| *value);
        }
        if after == self.keys.len() {
            return self.last();
        }
        let ((t0, from), (t1, to)) = (self.keys[after - 1], self.keys[after]);
        let step = t1 - t0;
        let u = (t - t0) / step;
        std::array::from_fn(|k| {
            hermite(
                u,
                from[k],
                to[k],
                step * self.slope(after - 1, k),
                step * self.slope(after, k),
            )
        })
    }

    /// The curve at frames `0..frames`.
    pub fn sample(&self, frames: usize) -> Vec<[f64; K]> {
        (0..frames).map(|frame| self.at(frame as f64)).collect()
    }

    /// The slope at a key: zero at extremes and ends, else the harmonic mean of the neighbouring
    /// slopes.
    fn slope(&self, key: usize, k: usize) -> f64 {
        if key == 0 || key + 1 >= self.keys.len() {
            return 0.0;
        }
        let chord = |a: usize, b: usize| {
            (self.keys[b].1[k] - self.keys[a].1[k]) / (self.keys[b].0 - self.keys[a].0)
        };
        let (before, after) = (chord(key - 1, key), chord(key, key + 1));
        if before * after <= 0.0 {
            return 0.0;
        }
        2.0 * before * after / (before + after)
    }
}

/// Cubic Hermite between `from` and `to` at `u` in 0..1, with tangents over the whole piece.
pub fn hermite(u: f64, from: f64, to: f64, tangent_from: f64, tangent_to: f64) -> f64 {
    let (u2, u3) = (u * u, u * u * u);
    (2.0 * u3 - 3.0 * u2 + 1.0) * from
        + (u3 - 2.0 * u2 + u) * tangent_from
        + (3.0 * u2 - 2.0 * u3) * to
        + (u3 - u2) * tangent_to
}

/// `3 u^2 - 2 u^3`: from 0 to 1, at rest at both ends.
pub fn ease(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

/// Smooths each number over time with a Gaussian of `sigma` frames, ends held; the kernel reaches
/// `ceil(3 sigma)` frames.
pub fn smooth<const K: usize>(values: &[[f64; K]], sigma: f64) -> Vec<[f64; K]> {
    if values.is_empty() {
        return Vec::new();
    }
    let reach = (3.0 * sigma).ceil() as usize;
    let weights: Vec<f64> = (0..=2 * reach)
        .map(|i| (-0.5 * ((i as f64 - reach as f64) / sigma).powi(2)).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    (0..values.len())
        .map(|frame| {
            let mut sum = [0.0; K];
            for (i, weight) in weights.iter().enumerate() {
                let source = (frame + i).saturating_sub(reach).min(values.len() - 1);
                for (sum, value) in sum.iter_mut().zip(values[source]) {
                    *sum += weight / total * value;
                }
            }
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_meets_its_keys_and_never_overshoots_them() {
        let mut track = Track::new([0.0]);
        for (frame, value) in [(10.0, 5.0), (12.0, 6.0), (30.0, 6.0), (31.5, -4.0)] {
            track.key(frame, [value]);
        }
        assert_eq!(track.at(10.0), [5.0]);
        assert_eq!(track.at(30.0), [6.0]);
        for tenth in 0..400 {
            let [value] = track.at(0.1 * f64::from(tenth));
            let inside = (-4.0 - 1e-9..=6.0 + 1e-9).contains(&value);
            assert!(inside, "{value} at {tenth}");
        }
        assert!((track.at(20.0)[0] - 6.0).abs() < 1e-9);
        assert_eq!(track.at(100.0), [-4.0]);
    }

    #[test]
    fn a_later_key_replaces_those_it_precedes() {
        let mut track = Track::new([1.0]);
        track.key(10.0, [2.0]);
        track.key(20.0, [3.0]);
        track.key(15.0, [7.0]);
        assert_eq!(track.at(50.0), [7.0]);
        assert_eq!(track.at(10.0), [2.0]);
    }

    #[test]
    fn smoothing_keeps_a_constant_and_the_mean_of_a_step() {
        let constant = smooth(&[[3.0]; 20], 2.0);
        assert!(constant.iter().all(|[v]| (v - 3.0).abs() < 1e-12));
        let step: Vec<[f64; 1]> = (0..40).map(|i| [f64::from(u8::from(i >= 20))]).collect();
        let smoothed = smooth(&step, 3.0);
        assert!(
            smoothed
                .windows(2)
                .all(|pair| pair[1][0] >= pair[0][0] - 1e-12)
        );
        assert!((smoothed[19][0] + smoothed[20][0] - 1.0).abs() < 1e-12);
    }
}
