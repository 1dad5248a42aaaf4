//! A smooth curve through a few points, and how fast a root goes along it.

use glam::DVec3;

/// Points of the curve between two given ones, from which its length is measured.
const STEPS: usize = 64;

/// How fast the root goes along a curve.
#[derive(Debug, Clone, PartialEq)]
pub enum Speed {
    /// The same all the way.
    Constant,
    /// In proportion to these speeds, one for each step from a frame to the next (cm/frame or any
    /// other unit). All zero counts as constant, and so does another number of them.
    Like(Vec<f64>),
}

/// A centripetal Catmull-Rom spline through `points` (cm) as a path of `frames` frames, from the
/// first point to the last.
///
/// Centripetal (Yuksel et al. 2011, alpha = 0.5): it has no loops or cusps between points at unlike
/// distances. Points that repeat the one before are left out. One point gives a root that stands
/// still.
pub fn smooth_curve(points: &[DVec3], frames: usize, speed: &Speed) -> Vec<DVec3> {
    let mut distinct: Vec<DVec3> = Vec::with_capacity(points.len());
    for &point in points {
        if distinct
            .last()
            .is_none_or(|last| last.distance(point) > 1e-6)
        {
            distinct.push(point);
        }
    }
    if distinct.len() < 2 || frames < 2 {
        return vec![distinct.first().copied().unwrap_or_default(); frames];
    }
    let fine = sampled(&distinct);
    let mut reached = vec![0.0];
    for pair in fine.windows(2) {
        reached.push(reached[reached.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = reached[reached.len() - 1];
    shares(frames, speed)
        .into_iter()
        .map(|share| along(&fine, &reached, share * length))
        .collect()
}

/// A smooth path through `points` (cm) that is at each of them at its time, ascending from 0; one
/// point a frame up to the last time.
///
/// Cubic between neighbours, with the velocity at each point that a parabola through it and its
/// neighbours has there.
pub(crate) fn timed_curve(times: &[usize], points: &[DVec3]) -> Vec<DVec3> {
    let slope = |k: usize| (points[k + 1] - points[k]) / (times[k + 1] - times[k]) as f64;
    let last = points.len() - 1;
    let velocity = |k: usize| match k {
        0 => slope(0),
        _ if k == last => slope(last - 1),
        _ => {
            let (before, after) = (
                (times[k] - times[k - 1]) as f64,
                (times[k + 1] - times[k]) as f64,
            );
            (after * slope(k - 1) + before * slope(k)) / (before + after)
        }
    };
    let mut path = vec![points[0]];
    for k in 0..last {
        let length = (times[k + 1] - times[k]) as f64;
        let (from, to) = (length * velocity(k), length * velocity(k + 1));
        for frame in times[k] + 1..=times[k + 1] {
            let s = (frame - times[k]) as f64 / length;
            let (s2, s3) = (s * s, s * s * s);
            path.push(
                (2.0 * s3 - 3.0 * s2 + 1.0) * points[k]
                    + (s3 - 2.0 * s2 + s) * from
                    + (3.0 * s2 - 2.0 * s3) * points[k + 1]
                    + (s3 - s2) * to,
            );
        }
    }
    path
}

/// Share of the whole way that is gone at each frame, from 0 to 1.
fn shares(frames: usize, speed: &Speed) -> Vec<f64> {
    let steps = frames - 1;
    let speeds = match speed {
        Speed::Like(speeds) if speeds.len() == steps && speeds.iter().sum::<f64>() > 0.0 => {
            speeds.clone()
        }
        _ => vec![1.0; steps],
    };
    let whole: f64 = speeds.iter().sum();
    let mut gone = 0.0;
    let mut shares = vec![0.0];
    for speed in speeds {
        gone += speed;
        shares.push(gone / whole);
    }
    shares
}

/// The point of a polyline at a distance from its start; `reached` are the distances of its points.
fn along(fine: &[DVec3], reached: &[f64], distance: f64) -> DVec3 {
    let after = reached.partition_point(|&reached| reached < distance);
    let after = after.clamp(1, fine.len() - 1);
    let (from, to) = (reached[after - 1], reached[after]);
    let share = if to > from {
        ((distance - from) / (to - from)).clamp(0.0, 1.0)
    } else {
        1.0
    };
    fine[after - 1].lerp(fine[after], share)
}

/// The spline as a fine polyline; before the first and after the last point stands its mirror
/// image.
fn sampled(points: &[DVec3]) -> Vec<DVec3> {
    let last = points.len() - 1;
    let mut padded = vec![2.0 * points[0] - points[1]];
    padded.extend_from_slice(points);
    padded.push(2.0 * points[last] - points[last - 1]);
    let mut fine = vec![points[0]];
    for four in padded.windows(4) {
        let knots: Vec<f64> = four
            .windows(2)
            .scan(0.0, |knot, pair| {
                *knot += pair[0].distance(pair[1]).sqrt();
                Some(*knot)
            })
            .collect();
        let knots = [0.0, knots[0], knots[1], knots[2]];
        for step in 1..=STEPS {
            let at = knots[1] + (knots[2] - knots[1]) * step as f64 / STEPS as f64;
            fine.push(barry_goldman(four, knots, at));
        }
    }
    fine
}

/// The segment from the second to the third of four points at a knot value between theirs.
fn barry_goldman(points: &[DVec3], knots: [f64; 4], at: f64) -> DVec3 {
    let mix = |a: DVec3, b: DVec3, from: f64, to: f64| a.lerp(b, (at - from) / (to - from));
    let a: [DVec3; 3] =
        std::array::from_fn(|k| mix(points[k], points[k + 1], knots[k], knots[k + 1]));
    let b: [DVec3; 2] = std::array::from_fn(|k| mix(a[k], a[k + 1], knots[k], knots[k + 2]));
    mix(b[0], b[1], knots[1], knots[2])
}
