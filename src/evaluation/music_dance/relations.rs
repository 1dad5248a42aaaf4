//! The 32 relations between joints whose shares are the geometric features (Mueller et al. 2005, in
//! the selection of the public tools of AIST++), as data.

use Length::{Hips, Shoulders, UpperArm};
use Place::{Down, Floor, Joint, Origin, Up};

/// A point that relations speak of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// A joint by its name.
    Joint(&'static str),
    /// (0, 0, 0).
    Origin,
    /// (0, 1, 0).
    Up,
    /// (0, -1, 0).
    Down,
    /// (0, y, 0), y the height of the frame's lowest joint.
    Floor,
}

/// A measure of the body at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Length {
    /// h: from arm to forearm, left.
    UpperArm,
    /// s: between both arms.
    Shoulders,
    /// w: between both upper legs.
    Hips,
}

/// So many times a length.
pub(super) type Threshold = (f64, Length);

/// What is asked of a frame; every threshold must be exceeded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Relation {
    /// Of (a, b, c): the speed of c relative to a, along b - a, per second.
    Move([Place; 3], Threshold),
    /// Of (a, b, c, d): the speed of d relative to a along the normal (c - a) x (b - a), per
    /// second.
    NormalMove([Place; 4], Threshold),
    /// Of (a, b, c, d): the distance of d from the plane through a with that normal.
    Plane([Place; 4], Threshold),
    /// Of (a, b, c, d): d - c along b - a.
    NormalPlane([Place; 4], Threshold),
    /// Of (a, b, c, d): whether the angle of b - a and d - c lies between two, degrees.
    Angle([Place; 4], [f64; 2]),
    /// The speed of a joint, per second.
    Fast(Place, Threshold),
}

const NECK: Place = Joint("Neck");
const CHEST: Place = Joint("Spine3");
const BELLY: Place = Joint("Spine");
const ROOT: Place = Joint("Hips");
const RIGHT_SHOULDER: Place = Joint("RightArm");
const LEFT_SHOULDER: Place = Joint("LeftArm");
const RIGHT_ELBOW: Place = Joint("RightForeArm");
const LEFT_ELBOW: Place = Joint("LeftForeArm");
const RIGHT_WRIST: Place = Joint("RightHand");
const LEFT_WRIST: Place = Joint("LeftHand");
const RIGHT_HIP: Place = Joint("RightUpLeg");
const LEFT_HIP: Place = Joint("LeftUpLeg");
const RIGHT_KNEE: Place = Joint("RightLeg");
const LEFT_KNEE: Place = Joint("LeftLeg");
const RIGHT_ANKLE: Place = Joint("RightFoot");
const LEFT_ANKLE: Place = Joint("LeftFoot");
const RIGHT_TOES: Place = Joint("RightToeBase");
const LEFT_TOES: Place = Joint("LeftToeBase");

/// Number of relations.
pub(super) const COUNT: usize = 32;

/// In the order of the public tools.
#[rustfmt::skip]
pub(super) const RELATIONS: [Relation; COUNT] = {
    use Relation::{Angle, Fast, Move, NormalMove, NormalPlane, Plane};
    [
        NormalMove([NECK, RIGHT_HIP, LEFT_HIP, RIGHT_WRIST], (1.8, UpperArm)),
        NormalMove([NECK, LEFT_HIP, RIGHT_HIP, LEFT_WRIST], (1.8, UpperArm)),
        NormalPlane([CHEST, NECK, NECK, RIGHT_WRIST], (0.2, UpperArm)),
        NormalPlane([CHEST, NECK, NECK, LEFT_WRIST], (0.2, UpperArm)),
        // The public list names a wrist here that it does not use; both stay, for their dimension.
        Move([BELLY, CHEST, CHEST], (1.8, UpperArm)),
        Move([BELLY, CHEST, CHEST], (1.8, UpperArm)),
        Angle([RIGHT_ELBOW, RIGHT_SHOULDER, RIGHT_ELBOW, RIGHT_WRIST], [0.0, 110.0]),
        Angle([LEFT_ELBOW, LEFT_SHOULDER, LEFT_ELBOW, LEFT_WRIST], [0.0, 110.0]),
        NormalPlane([LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_WRIST, RIGHT_WRIST], (2.5, Shoulders)),
        Move([LEFT_WRIST, RIGHT_WRIST, RIGHT_WRIST], (1.4, UpperArm)),
        Move([RIGHT_WRIST, ROOT, LEFT_WRIST], (1.4, UpperArm)),
        Move([LEFT_WRIST, ROOT, RIGHT_WRIST], (1.4, UpperArm)),
        Fast(RIGHT_WRIST, (2.5, UpperArm)),
        Fast(LEFT_WRIST, (2.5, UpperArm)),
        Plane([ROOT, LEFT_HIP, LEFT_TOES, RIGHT_ANKLE], (0.38, UpperArm)),
        Plane([ROOT, RIGHT_HIP, RIGHT_TOES, LEFT_ANKLE], (0.38, UpperArm)),
        NormalPlane([Origin, Up, Floor, RIGHT_ANKLE], (1.2, UpperArm)),
        NormalPlane([Origin, Up, Floor, LEFT_ANKLE], (1.2, UpperArm)),
        NormalPlane([LEFT_HIP, RIGHT_HIP, LEFT_ANKLE, RIGHT_ANKLE], (2.1, Hips)),
        Angle([RIGHT_KNEE, RIGHT_HIP, RIGHT_KNEE, RIGHT_ANKLE], [0.0, 110.0]),
        Angle([LEFT_KNEE, LEFT_HIP, LEFT_KNEE, LEFT_ANKLE], [0.0, 110.0]),
        Fast(RIGHT_ANKLE, (2.5, UpperArm)),
        Fast(LEFT_ANKLE, (2.5, UpperArm)),
        Angle([NECK, ROOT, RIGHT_SHOULDER, RIGHT_ELBOW], [25.0, 180.0]),
        Angle([NECK, ROOT, LEFT_SHOULDER, LEFT_ELBOW], [25.0, 180.0]),
        Angle([NECK, ROOT, RIGHT_HIP, RIGHT_KNEE], [50.0, 180.0]),
        Angle([NECK, ROOT, LEFT_HIP, LEFT_KNEE], [50.0, 180.0]),
        Plane([RIGHT_ANKLE, NECK, LEFT_ANKLE, ROOT], (0.5, UpperArm)),
        Angle([NECK, ROOT, Origin, Up], [70.0, 110.0]),
        NormalPlane([Origin, Down, Floor, RIGHT_WRIST], (-1.2, UpperArm)),
        NormalPlane([Origin, Down, Floor, LEFT_WRIST], (-1.2, UpperArm)),
        Fast(ROOT, (2.3, UpperArm)),
    ]
};
