//! The camera of the motion figures.

use glam::{DQuat, DVec3};

/// A fixed three-quarter view without perspective: from the front, a little from the dancer's left and from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    view: DQuat,
    /// Pixels a centimetre.
    scale: f64,
}

impl Camera {
    /// The camera stands 30 degrees to the side of +Z and looks down by 10 degrees.
    pub fn three_quarter(scale: f64) -> Self {
        let aside = DQuat::from_rotation_y(-30f64.to_radians());
        let down = DQuat::from_rotation_x(10f64.to_radians());
        Self {
            view: down * aside,
            scale,
        }
    }

    /// Where a point in the world (cm) appears: pixels to the right and down from the origin's place, and its nearness to the camera
    /// (cm; larger is nearer).
    pub fn project(&self, point: DVec3) -> ([f64; 2], f64) {
        let seen = self.view * point;
        ([self.scale * seen.x, -self.scale * seen.y], seen.z)
    }
}
