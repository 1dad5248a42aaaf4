//! Writes the seeds that the fuzzer begins with, `seeds/TARGET/*`: small valid files of each kind.

use std::fs;
use std::path::Path;

use keydance::autograd::Parameters;
use keydance::models::transition::Standardisation;
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::models::weights::to_safetensors;
use keydance::motion::DANCE_JOINTS;
use keydance::motion::bvh::{Axis, Bvh, channel_layout};
use keydance::nn::Initialiser;
use keydance::run::state::{Header, Moments};
use keydance::experiment::ExperimentConfig;
use keydance::models::Streams;

const BVH: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 90 0 1 2 3 4 5 6
1 91 0 1 2 3 4 5 6
";

const SMALL_MODEL: &str = "[model]\nkind = 'pan2021'\nhidden = 1\ncode = 1\nheads = 1\nfeed_forward = 1\nwindow = 1\n\
    encoder_layers = 1\ndecoder_layers = 1\n";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let write = |target: &str, name: &str, content: &[u8]| {
        let folder = root.join("seeds").join(target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(name), content)
    };
    write("bvh", "two_joints", BVH.as_bytes())?;
    let clip = generate(&ChoreographyConfig {
        clips: 1,
        frames_per_clip: 2,
        seed: 0,
    })?
    .remove(0)
    .clip;
    let channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
    let text = Bvh::from_clip(&clip, channels)?.to_text();
    write("bvh", "dance_skeleton", text.as_bytes())?;

    let defaults = ExperimentConfig::default().to_toml()?;
    write("config", "defaults", defaults.as_bytes())?;
    let list = "[data.split.list]\ntrain = ['a.bvh']\ntest = ['b.bvh']\n[model]\nkind = 'interpolation'\n";
    write("config", "interpolation", list.as_bytes())?;
    write("config", "set_number", b"\0schedule.fraction=0.005")?;
    write("config", "set_table", b"\0data.split={ share = 0.5 }")?;

    let mut mapping = "scale = 2.54\n[joints]\n".to_string();
    for joint in DANCE_JOINTS {
        mapping += &match joint {
            "Spine1" => format!("{joint} = {{ between = [\"Spine\", \"Spine2\"], at = 0.5 }}\n"),
            "Head" => format!("{joint} = \"Head/End Site\"\n"),
            _ => format!("{joint} = \"{joint}\"\n"),
        };
    }
    write("mapping", "dance_skeleton", mapping.as_bytes())?;

    write("music", "two_channels.wav", &wav())?;

    let config = ExperimentConfig::parse(SMALL_MODEL, "the small model")?;
    let standardisation = Standardisation::fit([]);
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, Streams::new(1).initialisation());
    config.model.build(&mut init, &standardisation)?;
    let weights = to_safetensors(&parameters, &standardisation, &config.to_toml()?)?;
    write("weights", "small_model", &weights)?;

    let header = Header {
        steps: 12,
        epoch: 3,
        position: 2,
        frame_steps: 4000,
        config_digest: "c".into(),
        data_digest: "d".into(),
        weights_file_digest: "w".into(),
    };
    let moments: Moments = [vec![vec![0.5, -1.0], vec![]], vec![vec![0.25, 1.0], vec![]]];
    let format = bincode::config::standard();
    let mut payload = bincode::serde::encode_to_vec(&header, format)?;
    payload.extend(bincode::serde::encode_to_vec(&moments, format)?);
    write("state", "payload", &payload)?;
    Ok(())
}

/// A tenth of a second of two channels at 44,100 Hz.
fn wav() -> Vec<u8> {
    let sample = |n: i16| n.wrapping_mul(7_919).to_le_bytes();
    let data: Vec<u8> = (0..8_820).flat_map(sample).collect();
    let mut file = b"RIFF".to_vec();
    file.extend((36 + data.len() as u32).to_le_bytes());
    file.extend(b"WAVEfmt \x10\0\0\0\x01\0\x02\0");
    file.extend(44_100u32.to_le_bytes());
    file.extend(176_400u32.to_le_bytes());
    file.extend(b"\x04\0\x10\0data");
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(data);
    file
}
