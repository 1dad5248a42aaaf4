//! Motion without learning: skeletons, clips, BVH files, forward kinematics, the features of a
//! frame.
//!
//! Units: centimetres, radians, seconds; Y is up. Computed in f64.

pub mod bvh;
pub mod clip;
pub mod columns;
pub mod contact;
pub mod contact_foot;
pub mod exponential_map;
pub mod facing;
pub mod features;
pub mod fit;
pub mod floor;
pub mod frame_rate;
pub mod ik;
pub mod mapping;
pub mod mirror;
pub mod oddities;
pub mod placement;
pub mod resample;
pub mod rest_pose;
pub mod rig;
pub mod root_reconstruction;
pub mod rotation_6d;
pub mod rotation_fit;
pub mod rotation_window;
pub mod skeleton;
pub mod tempo;
pub mod units;
pub mod velocity_factor;

pub use clip::{Clip, Pose};
pub use columns::{ColumnsError, GroundPlace, MotionColumns, NamedRotation};
pub use contact_foot::{ContactRule, Feet, Foot, MissingJoint};
pub use features::{FeatureConfig, FeatureError, features};
pub use floor::{Floor, ON_FLOOR};
pub use mapping::{Mapping, MappingError};
pub use mirror::mirror_image;
pub use resample::{ResampleError, resample};
pub use rig::Recognised;
pub use skeleton::{DANCE_JOINTS, DANCE_PARENTS, JOINTS, Joint, Skeleton};
pub use tempo::at_tempo;
pub use units::{Along, Conversion, Measured, Unit, Up};
pub use velocity_factor::{
    PART_NAMES, PART_WEIGHTS, PARTS, measured_velocity_factors, velocity_factors,
    velocity_factors_between,
};
