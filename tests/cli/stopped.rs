//! Trainings that are stopped, killed or cannot write, through the binary: nothing is lost, and the
//! end is the same to the bit.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

use keydance::autograd::kernels::Isa;
use keydance::run::checkpoint::list;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folders::{copy, files};
use crate::generated_data::write_clips;
use crate::small_run::{SmallRun, digest, keydance, stderr};

/// A schedule that no test waits to the end of.
const LONG: [&str; 4] = [
    "--set",
    "schedule.max_len=40",
    "--set",
    "schedule.fraction=1",
];

/// A training in the background, its output in pipes.
fn begin(small: &SmallRun, run: &Path, more: &[&str]) -> Child {
    keydance()
        .args(small.train_arguments(run, more))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn kill(child: &Child, signal: &str) {
    let id = child.id().to_string();
    let killed = Command::new("kill").args([signal, &id]).status().unwrap();
    assert!(killed.success());
}

/// Waits until a training has logged more than `bytes` bytes.
fn wait_for_log(child: &mut Child, run: &Path, bytes: u64) {
    let begun = Instant::now();
    while fs::metadata(run.join("log.jsonl")).map_or(0, |log| log.len()) <= bytes {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        assert!(
            begun.elapsed() < Duration::from_secs(120),
            "it logs nothing"
        );
        sleep(Duration::from_millis(5));
    }
}

fn manifest(run: &Path) -> Value {
    serde_json::from_slice(&fs::read(run.join("manifest.json")).unwrap()).unwrap()
}

/// The line of `keydance runs` about the one run in a folder, and what is said of it below.
fn listed(folder: &Path) -> String {
    let output = keydance().arg("runs").arg(folder).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().skip(1).collect::<Vec<_>>().join("\n")
}

/// A long training that was stopped by Ctrl-C after its first steps, with what it said.
struct Stopped {
    small: SmallRun,
    output: Output,
}

static STOPPED: LazyLock<Stopped> = LazyLock::new(|| {
    let small = SmallRun::new();
    let run = small.path("stopped");
    let mut child = begin(&small, &run, &LONG);
    wait_for_log(&mut child, &run, 0);

    // While it runs, nobody else writes there.
    for more in [&[][..], &["--resume"]] {
        let second = small.train(&run, &[&LONG[..], more].concat());
        let text = stderr(&second);
        assert_eq!(second.status.code(), Some(1), "{text}");
        assert!(
            text.contains("another training writes to") && text.contains("--out"),
            "{text}"
        );
    }
    let line = listed(&run);
    assert!(line.contains("running") && line.contains("small"), "{line}");

    kill(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    Stopped { small, output }
});

impl Stopped {
    fn run(&self) -> PathBuf {
        self.small.path("stopped")
    }

    /// A copy of the run in a folder of its own.
    fn copied(&self) -> (TempDir, PathBuf) {
        let folder = TempDir::new().unwrap();
        let run = folder.path().join("copy");
        copy(&self.run(), &run);
        (folder, run)
    }

    /// Goes on with a copy of the run, from its newest checkpoint, until it has logged a step more.
    fn goes_on(&self, run: &Path) {
        let (steps, _) = list(&run.join("checkpoints")).unwrap().pop().unwrap();
        let before = fs::metadata(run.join("log.jsonl")).unwrap().len();
        let mut child = begin(&self.small, run, &[&LONG[..], &["--resume"]].concat());
        wait_for_log(&mut child, run, before);
        child.kill().unwrap();
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(
            said.contains(&format!("goes on after step {steps}\n")),
            "{said}"
        );
    }
}

#[test]
fn ctrl_c_ends_the_step_saves_and_says_how_to_go_on() {
    let stopped = &*STOPPED;
    let text = stderr(&stopped.output);
    assert_eq!(stopped.output.status.code(), Some(130), "{text}");
    let manifest = manifest(&stopped.run());
    let steps = manifest["steps_done"].as_u64().unwrap();
    assert_eq!(manifest["state"], "stopped");
    assert!(
        text.contains(&format!("stopped and saved after step {steps} of ")),
        "{text}"
    );
    let saved = stopped
        .run()
        .join(format!("checkpoints/step-{steps:08}/state.bin"));
    assert!(saved.exists());
    let line = listed(&stopped.run());
    assert!(
        line.contains("stopped") && line.contains(&format!("{steps}/")),
        "{line}"
    );

    // The command that it names goes on, in a shell; SIGTERM stops it as Ctrl-C does.
    let (_folder, run) = stopped.copied();
    let command = text
        .lines()
        .rfind(|line| line.contains("--resume"))
        .unwrap();
    let command = command.trim().strip_prefix("keydance ").unwrap();
    let command = command.replace(stopped.run().to_str().unwrap(), run.to_str().unwrap());
    let before = fs::metadata(run.join("log.jsonl")).unwrap().len();
    let mut child = Command::new("sh")
        .args(["-c", &format!("exec \"$0\" {command}")])
        .arg(assert_cmd::cargo::cargo_bin!("keydance"))
        .spawn()
        .unwrap();
    wait_for_log(&mut child, &run, before);
    kill(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn a_training_that_is_stopped_before_its_first_step_says_how_to_begin() {
    let small = SmallRun::new();
    let run = small.path("run");
    // Wide enough for a first step of seconds.
    let wide = [
        "model.hidden=512",
        "model.code=512",
        "model.feed_forward=512",
    ];
    let slow = [
        "schedule.batch_size=512",
        "schedule.shards=1",
        "schedule.fraction=1",
    ];
    let sets: Vec<&str> = [wide, slow]
        .concat()
        .into_iter()
        .flat_map(|set| ["--set", set])
        .collect();
    let mut child = begin(&small, &run, &sets);
    while !run.join("config.toml").exists() {
        sleep(Duration::from_millis(5));
    }
    kill(&child, "-TERM");
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < Duration::from_secs(20));
        sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let said = stderr(&output);
    assert!(
        said.contains("stopped before a step was done; go on with"),
        "{said}"
    );
    assert!(said.trim_end().ends_with("--resume"), "{said}");
    assert!(run.join("config.toml").exists() && !run.join("checkpoints").exists());
}

#[test]
fn a_training_does_not_write_among_other_files() {
    let small = SmallRun::new();
    let run = small.path("run");
    fs::create_dir(&run).unwrap();
    fs::write(run.join("loss_curve.svg"), "mine").unwrap();
    let refused = small.train(&run, &[]);
    assert!(stderr(&refused).contains("holds other files, such as loss_curve.svg"));
    assert_eq!(fs::read_dir(&run).unwrap().count(), 1);
    // What a process that was killed left of its config is no other file, and is taken away.
    let killed = small.path("killed");
    let left = killed.join(".config.toml.1-0.partial");
    fs::create_dir(&killed).unwrap();
    fs::write(&left, "name =").unwrap();
    digest(&small.train(&killed, &["--set", "schedule.fraction=0.05"]));
    assert!(!left.exists());
}

#[test]
fn a_training_whose_messages_nobody_reads_goes_on_to_the_same_bits() {
    let small = SmallRun::new();
    let read = small.train(&small.path("read"), &[]);
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    let unread = keydance()
        .args(small.train_arguments(&small.path("unread"), &[]))
        .stderr(closed)
        .output()
        .unwrap();
    assert!(stderr(&read).contains("step 1/"), "{}", stderr(&read));
    assert_eq!(digest(&unread), digest(&read));
}

#[test]
fn a_killed_run_is_listed_as_interrupted_and_goes_on() {
    let (_folder, run) = STOPPED.copied();
    STOPPED.goes_on(&run);
    let line = listed(&run);
    assert!(line.contains("interrupted"), "{line}");
    STOPPED.goes_on(&run);
}

#[test]
fn a_disk_that_takes_no_more_is_an_error_and_the_last_checkpoint_stays() {
    let (_folder, run) = STOPPED.copied();
    let before = files(&run.join("checkpoints"));
    // A limit on the size of a file, in blocks of 512 or 1024 bytes: the weights are larger, the
    // log is not.
    let weights = before
        .iter()
        .find(|(path, _)| path.ends_with("weights.safetensors"));
    assert!(weights.unwrap().1.len() > 100_000);
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 80; exec \"$0\" \"$@\""])
        .arg(assert_cmd::cargo::cargo_bin!("keydance"))
        .args(
            STOPPED
                .small
                .train_arguments(&run, &[&LONG[..], &["--resume"]].concat()),
        )
        .output()
        .unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.contains("weights.safetensors cannot be written: File too large"),
        "{text}"
    );
    for (path, content) in &before {
        assert_eq!(&fs::read(path).unwrap(), content, "{}", path.display());
    }
    STOPPED.goes_on(&run);
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_and_stays_as_it_is() {
    let (folder, run) = STOPPED.copied();
    let before = files(&run);
    let set = |mode| {
        for path in [run.join("checkpoints"), run.clone()] {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        }
    };
    set(0o555);
    // A file where the run's folder should be; then the folder itself, as somebody who may only
    // read it.
    let blocked = STOPPED
        .small
        .train(&STOPPED.small.path("small.toml/run"), &LONG);
    assert_eq!(blocked.status.code(), Some(1));
    assert!(stderr(&blocked).contains("small.toml/run cannot be created"));

    let mut command = keydance();
    if folder.path().metadata().unwrap().uid() == 0 {
        // Nothing keeps root from writing. Anybody may run a copy of the program.
        for path in [folder.path().to_path_buf(), STOPPED.small.path("")] {
            fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
        }
        let program = folder.path().join("keydance");
        fs::copy(assert_cmd::cargo::cargo_bin!("keydance"), &program).unwrap();
        command = Command::new(&program);
        command.uid(65534);
    }
    let output = command
        .args(
            STOPPED
                .small
                .train_arguments(&run, &[&LONG[..], &["--resume"]].concat()),
        )
        .output()
        .unwrap();
    set(0o755);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains(run.to_str().unwrap()), "{text}");
    assert!(text.contains("Permission denied"), "{text}");
    assert_eq!(files(&run), before);
    STOPPED.goes_on(&run);
}

#[test]
fn a_run_of_another_version_goes_on_or_says_which_version_made_it() {
    let (_folder, run) = STOPPED.copied();
    let rewrite = |change: &dyn Fn(&mut Value)| {
        let mut changed = manifest(&STOPPED.run());
        changed["version"] = "0.0.9".into();
        changed["commit"] = Value::Null;
        change(&mut changed);
        fs::write(run.join("manifest.json"), changed.to_string()).unwrap();
    };
    let refused = || {
        let output = STOPPED
            .small
            .train(&run, &[&LONG[..], &["--resume"]].concat());
        assert_eq!(output.status.code(), Some(1));
        let text = stderr(&output);
        assert!(
            text.contains("made by keydance 0.0.9, this is 0.1.0"),
            "{text}"
        );
        assert!(listed(&run).contains("0.0.9"), "{}", listed(&run));
        text
    };
    let config = fs::read_to_string(run.join("config.toml")).unwrap();

    // A key that this version does not know; a newer manifest; a newer training state.
    rewrite(&|_| ());
    fs::write(
        run.join("config.toml"),
        format!("{config}\n[music]\nbeats = true\n"),
    )
    .unwrap();
    let text = refused();
    assert!(
        text.contains("music") && listed(&run).contains("damaged"),
        "{text}"
    );
    fs::write(run.join("config.toml"), &config).unwrap();

    rewrite(&|manifest| manifest["format"] = 2.into());
    assert!(refused().contains("has format 2, and this version of keydance knows"));

    rewrite(&|_| ());
    for (path, mut content) in files(&run.join("checkpoints")) {
        if path.ends_with("state.bin") {
            content[8] = 2;
            fs::write(path, content).unwrap();
        }
    }
    assert!(refused().contains("has format 2, this version of keydance reads format 1"));

    // An older manifest, of before it had a format.
    copy(&STOPPED.run(), &run);
    rewrite(&|manifest| {
        manifest.as_object_mut().unwrap().remove("format");
    });
    assert!(listed(&run).ends_with("0.0.9"), "{}", listed(&run));
    STOPPED.goes_on(&run);
}

#[test]
fn a_divergence_has_an_exit_code_of_its_own_and_keeps_the_last_checkpoint() {
    let small = &STOPPED.small;
    let run = small.path("diverged");
    let sets = [
        "--set",
        "optimiser.learning_rate=1e30",
        "--set",
        "checkpoint.every_steps=1",
    ];
    let output = small.train(&run, &sets);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    let steps = manifest(&run)["steps_done"].as_u64().unwrap();
    for words in [
        format!("step {} (", steps + 1),
        "is not finite".into(),
        "operation".into(),
        "shape [".into(),
    ] {
        assert!(text.contains(&words), "{words}: {text}");
    }
    assert!(
        run.join(format!("checkpoints/step-{steps:08}/weights.safetensors"))
            .exists()
    );
    assert!(!run.join("weights.safetensors").exists());
    assert!(listed(&run).contains("diverged"), "{}", listed(&run));
}

#[test]
fn mistakes_in_the_command_or_its_files_have_exit_codes_of_their_own() {
    let small = &STOPPED.small;
    let code = |arguments: &[&str]| keydance().args(arguments).output().unwrap().status.code();
    assert_eq!(code(&["train"]), Some(2));
    assert_eq!(
        code(&[
            "train",
            "x.toml",
            "--data",
            "d",
            "--out",
            "o",
            "--threads",
            "0"
        ]),
        Some(2)
    );
    let output = small.train(&small.path("never"), &["--set", "schedule.fraction=2"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("schedule.fraction = 2"));
    assert!(!small.path("never").exists());
    let again = small.train(&STOPPED.run(), &LONG);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("holds a run already; go on with --resume"));
}

/// Clips that take seconds to score a model on, and a folder with one config of a small one.
static LONG_EVALUATION: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    for name in ["data", "configs"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    write_clips(&folder.path().join("data"), 4000, 3);
    let config = "name = 'small'\n[data]\nsplit = { share = 0.8 }\n[model]\nkind = 'pan2021'\n\
        hidden = 32\ncode = 16\nheads = 2\nfeed_forward = 16\n[schedule]\nmax_len = 6\n\
        frame_steps = 200\nbatch_size = 8\nshards = 1\n";
    fs::write(folder.path().join("configs/small.toml"), config).unwrap();
    folder
});

/// A command about that model, in its folder, its output in pipes.
fn about_long_evaluation(arguments: &[&str]) -> Command {
    let mut command = keydance();
    command
        .current_dir(LONG_EVALUATION.path())
        .args(arguments)
        .args(["--data", "data", "--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Sends a signal once a command says that it evaluates. How long it takes to end, how it does, and
/// what it says from there on.
fn stopped_while_evaluating(mut command: Command, signal: &str) -> (Duration, Option<i32>, String) {
    let mut child = command.spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let evaluates = |line: &std::io::Result<String>| line.as_ref().unwrap().contains("evaluating");
    let progress = lines.find(evaluates).unwrap().unwrap();
    assert!(
        progress.contains(" frames  ") && progress.ends_with(" left"),
        "{progress}"
    );
    let begun = Instant::now();
    kill(&child, signal);
    let said: Vec<String> = lines.map(Result::unwrap).collect();
    let code = child.wait().unwrap().code();
    (begun.elapsed(), code, said.join("\n"))
}

#[test]
fn ctrl_c_and_sigterm_end_an_evaluation_and_the_same_command_goes_on() {
    let folder = LONG_EVALUATION.path();
    let rows = ["reproduce", "configs", "--out", "results", "--runs", "runs"];
    let begun = Instant::now();
    let (took, code, said) = stopped_while_evaluating(about_long_evaluation(&rows), "-INT");
    let in_all = begun.elapsed();
    assert_eq!(code, Some(130), "{said}");
    // Chunks of windows that were begun are ended.
    assert!(took < Duration::from_secs(5), "{took:?} of {in_all:?}");
    assert!(said.contains("stopped and saved; go on with"), "{said}");
    let weights = fs::metadata(folder.join("runs/small/weights.safetensors")).unwrap();
    assert!(!folder.join("results/small/evaluation.json").exists());
    let run = folder.join("runs/small");
    let run = run.to_str().unwrap();
    let score = ["evaluate", run, "--json", "scores.json"];
    let (took, code, said) = stopped_while_evaluating(about_long_evaluation(&score), "-TERM");
    assert_eq!(code, Some(130), "{said}");
    assert!(took < Duration::from_secs(5), "{took:?}");
    assert!(said.contains("nothing is written"), "{said}");
    assert!(said.contains(&format!("keydance evaluate {run}")), "{said}");
    assert!(!folder.join("scores.json").exists());

    let output = about_long_evaluation(&rows).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(folder.join("results/small/evaluation.json").exists());
    // Nothing was trained again.
    let again = fs::metadata(folder.join("runs/small/weights.safetensors")).unwrap();
    assert_eq!(again.modified().unwrap(), weights.modified().unwrap());
}

#[test]
fn an_evaluation_does_not_wait_for_an_answer_that_takes_long() {
    let folder = LONG_EVALUATION.path();
    // The paper's sizes: an answer to 64 windows of 150 frames takes seconds on a thread.
    let config = "name = 'large'\n[data]\nsplit = { share = 0.8 }\n[model]\nkind = 'pan2021'\n\
        [schedule]\nmax_len = 6\nframe_steps = 50\nbatch_size = 8\nshards = 1\n";
    fs::write(folder.join("large.toml"), config).unwrap();
    let train = ["train", "large.toml", "--out", "large"];
    let output = about_long_evaluation(&train).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let score = ["evaluate", "large", "--lengths", "150"];
    let (took, code, said) = stopped_while_evaluating(about_long_evaluation(&score), "-INT");
    assert_eq!(code, Some(130), "{said}");
    assert!(took < Duration::from_secs(3), "{took:?}");
    assert!(said.contains("nothing is written"), "{said}");
}

#[test]
fn a_run_that_goes_on_with_another_instruction_set_says_so_and_keeps_both() {
    let small = SmallRun::new();
    let run = small.path("run");
    let train = |set: &str, more: &[&str]| {
        let mut command = keydance();
        let arguments = small.train_arguments(&run, more);
        command.args(arguments).env("KEYDANCE_ISA", set).output()
    };
    let portable = format!("portable {}", std::env::consts::ARCH);
    let finished = train("portable", &[]).unwrap();
    assert!(finished.status.success(), "{}", stderr(&finished));
    assert_eq!(manifest(&run)["instructions"], json!([portable]));
    // As if it had been killed before its end.
    fs::remove_file(run.join("weights.safetensors")).unwrap();
    let newest = list(&run.join("checkpoints")).unwrap().pop().unwrap().1;
    fs::remove_dir_all(newest).unwrap();
    let same = train("portable", &["--resume"]).unwrap();
    assert!(
        !stderr(&same).contains("instruction set"),
        "{}",
        stderr(&same)
    );
    let other = Isa::ALL.into_iter().find(|isa| isa.is_available());
    let other = other.unwrap().name();
    if other == "portable" {
        return;
    }
    fs::remove_file(run.join("weights.safetensors")).unwrap();
    let newest = list(&run.join("checkpoints")).unwrap().pop().unwrap().1;
    fs::remove_dir_all(newest).unwrap();
    let text = stderr(&train(other, &["--resume"]).unwrap());
    for words in ["warning: ", &portable, other, "bits"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(manifest(&run)["instructions"], json!([portable, other]));
}

/// Kills trainings with SIGKILL at random moments of their whole life, `kills` times together, and
/// goes on after each; whenever one gets to its end, its weights are those of a training that was
/// left alone, and another begins.
fn kill_and_resume(kills: usize, seed: u64) {
    let small = SmallRun::new();
    let expected = digest(&small.train(&small.path("alone"), &[]));
    let begun = Instant::now();
    assert_eq!(digest(&small.train(&small.path("again"), &[])), expected);
    let life = begun.elapsed();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut killed, mut saved, mut runs) = (0, 0, 0);
    while killed < kills {
        runs += 1;
        let run = small.path(&format!("run{runs}"));
        let finished = loop {
            let mut child = begin(&small, &run, &["--resume"]);
            if killed < kills {
                sleep(life.mul_f64(rng.random::<f64>()));
                if child.try_wait().unwrap().is_none() {
                    child.kill().unwrap();
                    child.wait().unwrap();
                    killed += 1;
                    saved += usize::from(run.join("checkpoints").exists());
                    continue;
                }
            }
            break child.wait_with_output().unwrap();
        };
        assert_eq!(digest(&finished), expected, "run {runs}");
    }
    eprintln!(
        "{killed} kills, {saved} of them after a checkpoint, in {runs} runs: all ended at {expected}"
    );
    assert!(saved > 0, "no kill found a checkpoint");
}

#[test]
fn sigkill_at_random_moments_loses_nothing() {
    let number = |name: &str, default| {
        let given = std::env::var(name).ok();
        given.map_or(default, |text| text.parse().unwrap())
    };
    kill_and_resume(
        number("KEYDANCE_KILLS", 6) as usize,
        number("KEYDANCE_KILL_SEED", 1),
    );
}

#[test]
fn the_command_to_resume_quotes_what_a_shell_would_change() {
    let small = SmallRun::new();
    fs::rename(small.path("small.toml"), small.path("a b.toml")).unwrap();
    let budget = "[schedule]\nmax_len = 40\nfraction = 1.0\n";
    fs::write(small.path("budget.toml"), budget).unwrap();
    let mut child = keydance()
        .current_dir(small.path("."))
        .args(["train", "a b.toml", "--data", "data", "--out", "runs/1"])
        .args(["--budget", "budget.toml", "--set", "name=x"])
        .args(["--set", "data.split={ share = 0.5 }", "--threads", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_log(&mut child, &small.path("runs/1"), 0);
    kill(&child, "-INT");
    let text = stderr(&child.wait_with_output().unwrap());
    let command = "keydance train 'a b.toml' --data data --out runs/1 --budget budget.toml \
                   --set name=x --set 'data.split={ share = 0.5 }' --threads 2 --resume";
    assert!(text.lines().any(|line| line.trim() == command), "{text}");
}

#[test]
fn a_training_whose_folder_is_moved_away_says_so_and_goes_on_from_where_it_was_moved() {
    let small = SmallRun::new();
    let (run, moved) = (small.path("run"), small.path("moved"));
    let mut child = begin(&small, &run, &LONG);
    wait_for_log(&mut child, &run, 2000);
    fs::rename(&run, &moved).unwrap();
    let ended = child.wait_with_output().unwrap();
    let text = stderr(&ended);
    assert_eq!(ended.status.code(), Some(1), "{text}");
    assert!(text.contains("was moved or removed"), "{text}");
    assert!(!run.exists(), "it was made again");
    let resumed = begin(&small, &moved, &[&LONG[..], &["--resume"]].concat());
    sleep(Duration::from_millis(1500));
    kill(&resumed, "-INT");
    let output = resumed.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("goes on after step"), "{text}");
}

#[test]
fn a_demo_that_is_stopped_says_so_and_how_it_begins_anew() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let mut child = keydance()
        .args(["demo", "--threads", "1", "--out"])
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_log(&mut child, &out, 0);
    kill(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{text}");
    let again = format!(
        "stopped; begin anew with\n  keydance demo --threads 1 --out {}",
        out.display()
    );
    assert!(text.contains(&again), "{text}");
    assert_eq!(manifest(&out)["state"], "stopped");
}
