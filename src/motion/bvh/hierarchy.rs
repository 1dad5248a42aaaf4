//! The HIERARCHY section. Open blocks are kept on a stack of our own, so deep nesting cannot
//! overflow the thread's.

use std::collections::HashMap;

use glam::DVec3;

use super::document::{Channel, MAX_DEPTH, is_name};
use super::error::BvhError;
use super::scanner::{Scanner, quoted};
use crate::motion::{Joint, Skeleton};

/// A block whose closing brace is still to come.
struct Block {
    joint: usize,
    kind: Kind,
    has_offset: bool,
    has_channels: bool,
    has_children: bool,
}

#[derive(PartialEq)]
enum Kind {
    Joint,
    EndSite,
}

/// Joints and their channels as they are read.
#[derive(Default)]
struct Hierarchy {
    joints: Vec<Joint>,
    channels: Vec<Vec<Channel>>,
    /// Line on which each name was given.
    named: HashMap<String, usize>,
    open: Vec<Block>,
}

/// Reads from HIERARCHY up to and with the word MOTION.
pub(super) fn hierarchy(scanner: &mut Scanner) -> Result<(Skeleton, Vec<Vec<Channel>>), BvhError> {
    scanner.keyword("HIERARCHY")?;
    let mut hierarchy = Hierarchy::default();
    loop {
        let word = scanner.word();
        let keyword = word.map(str::to_ascii_uppercase);
        let keyword = keyword.as_deref();
        let Some(block) = hierarchy.open.last() else {
            match keyword {
                Some("ROOT") => hierarchy.open_joint(scanner, None)?,
                Some("MOTION") if !hierarchy.joints.is_empty() => break,
                _ if hierarchy.joints.is_empty() => return Err(scanner.unexpected("ROOT", word)),
                _ => return Err(scanner.unexpected("MOTION", word)),
            }
            continue;
        };
        match (keyword, &block.kind) {
            (Some("OFFSET"), _) if !block.has_offset => hierarchy.offset(scanner)?,
            (Some("CHANNELS"), Kind::Joint) if !block.has_channels && !block.has_children => {
                hierarchy.channels(scanner)?
            }
            (Some("CHANNELS"), Kind::EndSite) if !block.has_channels => {
                hierarchy.no_channels(scanner)?
            }
            (Some("JOINT"), Kind::Joint) => hierarchy.open_joint(scanner, Some(block.joint))?,
            (Some("END"), Kind::Joint) => hierarchy.open_end_site(scanner, block.joint)?,
            (Some("}"), _) if block.has_offset => {
                hierarchy.open.pop();
            }
            _ => return Err(scanner.unexpected(&hierarchy.expected(block), word)),
        }
    }
    Ok((
        Skeleton {
            joints: hierarchy.joints,
        },
        hierarchy.channels,
    ))
}

impl Hierarchy {
    fn open_joint(&mut self, scanner: &mut Scanner, parent: Option<usize>) -> Result<(), BvhError> {
        let name = name(scanner)?;
        if let Some(line) = self.named.insert(name.clone(), scanner.line()) {
            let expected = format!("a joint name not given before (line {line} has it)");
            return Err(scanner.unexpected(&expected, Some(&name)));
        }
        if self.open.len() == MAX_DEPTH {
            let expected = format!("at most {MAX_DEPTH} joints inside one another");
            return Err(scanner.error(expected, format!("joint {} inside them", quoted(&name))));
        }
        if let Some(block) = self.open.last_mut() {
            block.has_children = true;
        }
        scanner.keyword("{")?;
        self.open.push(Block::new(self.joints.len(), Kind::Joint));
        self.joints.push(Joint {
            name,
            parent,
            offset: DVec3::ZERO,
            end_sites: Vec::new(),
        });
        self.channels.push(Vec::new());
        Ok(())
    }

    fn open_end_site(&mut self, scanner: &mut Scanner, joint: usize) -> Result<(), BvhError> {
        scanner.keyword("Site")?;
        // Some programs name it; nothing refers to that name.
        while scanner.peek_on_line().is_some_and(|word| word != "{") {
            scanner.word_on_line();
        }
        scanner.keyword("{")?;
        self.open.push(Block::new(joint, Kind::EndSite));
        Ok(())
    }

    fn offset(&mut self, scanner: &mut Scanner) -> Result<(), BvhError> {
        let mut offset = DVec3::ZERO;
        for (axis, what) in ["the offset's X", "the offset's Y", "the offset's Z"]
            .into_iter()
            .enumerate()
        {
            let word = scanner.word_on_line();
            offset[axis] = scanner.number(word, || what.to_string())?;
        }
        if let Some(block) = self.open.last_mut() {
            block.has_offset = true;
            match block.kind {
                Kind::Joint => self.joints[block.joint].offset = offset,
                Kind::EndSite => self.joints[block.joint].end_sites.push(offset),
            }
        }
        Ok(())
    }

    fn channels(&mut self, scanner: &mut Scanner) -> Result<(), BvhError> {
        let word = scanner.word_on_line();
        let count = match word.and_then(|word| word.parse::<usize>().ok()) {
            Some(count) if count <= 6 => count,
            _ => return Err(scanner.error("the number of channels, 0 to 6".into(), shown(word))),
        };
        let mut channels = Vec::new();
        for number in 1..=count {
            let word = scanner.word_on_line();
            let named = |name: &str| word.is_some_and(|word| word.eq_ignore_ascii_case(name));
            match Channel::NAMES.into_iter().find(|(name, _)| named(name)) {
                Some((_, channel)) if !channels.contains(&channel) => channels.push(channel),
                _ => {
                    let names = Channel::NAMES.map(|(name, _)| name).join(", ");
                    let expected = format!("channel {number} of {count}, each once, of {names}");
                    return Err(scanner.error(expected, shown(word)));
                }
            }
        }
        if let Some(block) = self.open.last_mut() {
            block.has_channels = true;
            self.channels[block.joint] = channels;
        }
        Ok(())
    }

    /// The `CHANNELS 0` that some programs give an End Site, too.
    fn no_channels(&mut self, scanner: &mut Scanner) -> Result<(), BvhError> {
        let word = scanner.word_on_line();
        if word.and_then(|word| word.parse::<usize>().ok()) != Some(0) {
            return Err(scanner.error("0 channels in an End Site".into(), shown(word)));
        }
        if let Some(block) = self.open.last_mut() {
            block.has_channels = true;
        }
        Ok(())
    }

    /// What may come next in a block.
    fn expected(&self, block: &Block) -> String {
        let name = &self.joints[block.joint].name;
        let (owner, further) = match block.kind {
            Kind::EndSite => (format!("an End Site of joint {name}"), Vec::new()),
            Kind::Joint if block.has_channels || block.has_children => {
                (format!("joint {name}"), vec!["JOINT", "End Site"])
            }
            Kind::Joint => (
                format!("joint {name}"),
                vec!["CHANNELS", "JOINT", "End Site"],
            ),
        };
        let first = if block.has_offset { "}" } else { "OFFSET" };
        let choice: Vec<&str> = [first].into_iter().chain(further).collect();
        format!("{} in {owner}", choice.join(" or "))
    }
}

impl Block {
    fn new(joint: usize, kind: Kind) -> Self {
        Self {
            joint,
            kind,
            has_offset: false,
            has_channels: false,
            has_children: false,
        }
    }
}

/// The rest of the line up to a brace: names of several words occur.
fn name(scanner: &mut Scanner) -> Result<String, BvhError> {
    let mut words = Vec::new();
    while let Some(word) = scanner.peek_on_line().filter(|word| *word != "{") {
        words.push(word);
        scanner.word_on_line();
    }
    let name = words.join(" ");
    if is_name(&name) {
        Ok(name)
    } else {
        let found = if name.is_empty() {
            "none".into()
        } else {
            quoted(&name)
        };
        Err(scanner.error("a joint name without braces".into(), found))
    }
}

fn shown(word: Option<&str>) -> String {
    word.map_or_else(|| "the end of the line".into(), quoted)
}
