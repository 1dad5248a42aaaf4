//! Root trajectory reconstruction (RTR) of Li et al., eq. 7 to 11: the root moves so that the foot
//! in contact stands still.

use glam::DVec3;

/// Root positions of every frame, `[frames]`, cm.
///
/// ```text
/// step_t = - s_right,t (P_R,t+1 - P_R,t) - s_left,t (P_L,t+1 - P_L,t)
/// R_t = R_1 + step_1 + .. + step_(t-1)
/// ```
///
/// `feet`: P, positions of the right and the left foot relative to the root in the world's
/// orientation, `[frames]`, cm; `weights`: s, right and left, `[frames]`, of which the last is not
/// used; `start`: R_1, cm.
pub fn reconstruct_root(feet: &[[DVec3; 2]], weights: &[[f64; 2]], start: DVec3) -> Vec<DVec3> {
    let mut root = start;
    let steps = feet.windows(2).zip(weights).map(|(pair, weights)| {
        let [right, left] = [0, 1].map(|foot| (pair[1][foot] - pair[0][foot]) * weights[foot]);
        root -= right + left;
        root
    });
    let steps: Vec<DVec3> = steps.collect();
    feet.first()
        .map(|_| start)
        .into_iter()
        .chain(steps)
        .collect()
}
