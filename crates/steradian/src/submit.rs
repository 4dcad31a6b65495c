//! `steradian submit`: a job for a scheduler that others keep: an array of parts, then a merge.
//!
//! Every part is the same command with another number, may be repeated at will, and is named by what it is of, so that a stale one is never
//! taken. The merge says by itself what is missing.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;

use clap::{Args, ValueEnum, ValueHint};
use steradian_image::write_bytes_atomically;
use steradian_render::{Layers, Part, Share};

use crate::aov::Aov;
use crate::args::{OutputArgs, PictureArgs};
use crate::console::Console;
use crate::failure::{DONE, ENVIRONMENT, Failure, reason};
use crate::model_args::quoted;
use crate::{keep, opened, output, overrides};

/// The schedulers.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scheduler {
    /// A job array
    Slurm,
    /// An indexed Job
    Kubernetes,
    /// An outline for OpenCue
    Opencue,
    /// GNU parallel, on this machine or over ssh
    Parallel,
}

/// The options.
#[derive(Args, Debug)]
pub(crate) struct SubmitArgs {
    /// Who runs it
    #[arg(value_name = "SCHEDULER")]
    pub scheduler: Scheduler,

    /// The scene, under a name that all machines know
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: PathBuf,

    /// How many parts
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub parts: u32,

    /// Where the parts are kept until they are merged: a folder that all machines share
    #[arg(long, value_name = "DIR", default_value = "parts", value_hint = ValueHint::DirPath)]
    pub part_folder: PathBuf,

    /// The file to write the job to [default: NAME.sbatch.sh, NAME.yaml, NAME.outline.py or NAME.parallel.sh]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub job: Option<PathBuf>,

    /// Submit it as well
    #[arg(long)]
    pub run: bool,

    /// Cores for each part
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub cores: u16,

    /// How often a part is tried that fails for the machine's sake
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub tries: u32,

    /// The program's name where it runs
    #[arg(long, value_name = "PROGRAM", default_value = "steradian")]
    pub program: String,

    /// Kubernetes: the container image that has the program
    #[arg(long, value_name = "IMAGE", default_value = "steradian:latest")]
    pub image: String,

    /// Kubernetes: the claim of the volume with scene and parts, which is mounted as the working folder
    #[arg(long, value_name = "CLAIM", default_value = "render")]
    pub volume: String,

    #[command(flatten)]
    pub output: OutputArgs,

    /// Channels for the .exr, as render takes them
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help_heading = "Output")]
    pub aov: Vec<Aov>,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

/// Everything that a job says.
struct Job<'a> {
    name: String,
    args: &'a SubmitArgs,
    /// The command for a part, whose number and name stand as `{i}` and `{part}`.
    render: String,
    /// The part's file without number and extension.
    stem: String,
    merge: String,
}

/// Writes the job, and submits it if asked; the exit code.
pub(crate) fn run(args: &SubmitArgs, console: &Console) -> Result<u8, Failure> {
    let console = console.quiet(args.quiet);
    if args.output.output.is_empty() {
        return Err(Failure::Input("-o FILE says where the picture goes".into()));
    }
    if args.output.variance.is_some() {
        return Err(Failure::Input("--variance: --aov variance is in the .exr instead".into()));
    }
    let job = prepare(args, &console)?;
    let (text, extension) = match args.scheduler {
        Scheduler::Slurm => (slurm(&job), "sbatch.sh"),
        Scheduler::Kubernetes => (kubernetes(&job), "yaml"),
        Scheduler::Opencue => (opencue(&job), "outline.py"),
        Scheduler::Parallel => (parallel(&job), "parallel.sh"),
    };
    let file = args.job.clone().unwrap_or_else(|| format!("{}.{extension}", job.name).into());
    output::check(&file)?;
    write_bytes_atomically(&file, text.as_bytes()).map_err(|e| Failure::Environment(e.to_string()))?;
    let start = match args.scheduler {
        Scheduler::Slurm | Scheduler::Parallel => vec!["sh".to_owned()],
        Scheduler::Kubernetes => ["kubectl", "apply", "-f"].map(str::to_owned).to_vec(),
        Scheduler::Opencue => vec!["python3".to_owned()],
    };
    console.say(format_args!("wrote {}: {} parts, then a merge", file.display(), args.parts));
    if !args.run {
        console.say(format_args!("next: {} {}", start.join(" "), quoted(&file.to_string_lossy())));
        return Ok(DONE);
    }
    let status = Command::new(&start[0])
        .args(&start[1..])
        .arg(&file)
        .status()
        .map_err(|e| Failure::Environment(format!("{} cannot be started: {}", start[0], reason(&e))))?;
    Ok(status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(ENVIRONMENT))
}

fn prepare<'a>(args: &'a SubmitArgs, console: &Console) -> Result<Job<'a>, Failure> {
    let opened = opened::open(Some(&args.scene), &args.picture, console)?;
    let (settings, hash) = (opened.scene.settings.clone(), opened.hash.clone());
    let world = opened::build(opened.scene, None)?;
    let share = Share::Tiles(Part { index: 0, count: args.parts });
    let mut identity =
        keep::identity(&settings, &hash, steradian_render::Adaptive::No, share, &Layers::new(Vec::new(), &world));
    identity.insert("spp".into(), settings.sampler.spp.to_string());
    let aovs: Vec<String> = args.aov.iter().map(|a| a.name()).collect();
    identity.insert("aov".into(), aovs.join(","));
    let key = blake3::hash(format!("{identity:?}").as_bytes()).to_hex()[..16].to_owned();
    let name = args.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let stem = args.part_folder.join(format!("{name}-{key}")).to_string_lossy().into_owned();
    let scene = quoted(&args.scene.to_string_lossy());
    let (program, cores, parts) = (quoted(&args.program), args.cores, args.parts);
    let mut options = overrides::as_typed(&args.picture);
    if !aovs.is_empty() {
        let _ = write!(options, " --aov {}", aovs.join(","));
    }
    let render =
        format!("{program} render {scene}{options} --threads {cores} --quiet --shard {{i}}/{parts} -o {{part}}");
    let mut merge = format!("{program} merge {}.*-of-{parts}.part", quoted(&stem));
    for path in &args.output.output {
        let _ = write!(merge, " -o {}", quoted(&path.to_string_lossy()));
    }
    merge += &args.output.as_typed();
    Ok(Job { name, args, render, stem, merge })
}

impl Job<'_> {
    /// The file of a part whose number the shell has in `number`.
    fn part(&self, number: &str) -> String {
        format!("{}.\"{number}\"-of-{}.part", quoted(&self.stem), self.args.parts)
    }

    /// Shell lines that make the part whose number is in `$i`, unless it is there. The program's exit code 2 says that the scene is at
    /// fault, which no repetition helps.
    fn once(&self) -> String {
        let render = self.render.replace("{i}", "\"$i\"").replace("{part}", "\"$part\"");
        let (part, tries) = (self.part("$i"), self.args.tries);
        format!(
            "part={part}\n[ -s \"$part\" ] && exit 0\ntry=1\nwhile :; do\n  {render} && exit 0\n  code=$?\n  \
             if [ \"$code\" -eq 2 ] || [ \"$try\" -ge {tries} ]; then exit \"$code\"; fi\n  try=$((try + 1))\n  sleep 5\ndone\n"
        )
    }

    fn folder(&self) -> String {
        quoted(&self.args.part_folder.to_string_lossy())
    }
}

fn slurm(job: &Job) -> String {
    let (name, args) = (&job.name, job.args);
    // `afterany`: a part that was requeued would make `afterok` impossible, and the merge knows what is missing.
    format!(
        "#!/bin/sh\n# {name}: {parts} parts as a Slurm array, then a merge. Again does only what is missing.\nset -eu\nmkdir -p {folder}\n\
         array=$(sbatch --parsable --requeue --job-name={word} --array=1-{parts} --cpus-per-task={cores} --output={folder}/%x-%a.log <<'PART'\n\
         #!/bin/sh\ni=$SLURM_ARRAY_TASK_ID\n{once}PART\n)\n\
         sbatch --parsable --job-name={word}-merge --dependency=\"afterany:${{array%%;*}}\" --output={folder}/%x.log <<'MERGE'\n\
         #!/bin/sh\nexec {merge}\nMERGE\n",
        parts = args.parts,
        cores = args.cores,
        folder = job.folder(),
        word = quoted(name),
        once = job.once(),
        merge = job.merge,
    )
}

fn parallel(job: &Job) -> String {
    format!(
        "#!/bin/sh\n# {name}: {parts} parts by GNU parallel, then a merge. Again does only what is missing.\n\
         # More machines: PARALLEL='--sshlogin host1,host2 --workdir .' sh THIS, with the same files on all.\nset -eu\nmkdir -p {folder}\n\
         jobs=$(( $(nproc) / {cores} ))\n\
         seq {parts} | parallel --jobs \"$(( jobs > 0 ? jobs : 1 ))\" --halt now,fail=50% sh -c {one} part {{}} || true\n\
         exec {merge}\n",
        name = job.name,
        parts = job.args.parts,
        folder = job.folder(),
        cores = job.args.cores,
        // Once for this shell, and once for the one that parallel starts.
        one = quoted(&quoted(&format!("i=$1\n{}", job.once()))),
        merge = job.merge,
    )
}

/// A block of YAML text under a key, indented.
fn block(text: &str, indent: usize) -> String {
    text.lines().map(|l| format!("{:indent$}{l}\n", "")).collect()
}

fn kubernetes(job: &Job) -> String {
    let args = job.args;
    let word: String =
        job.name.to_lowercase().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let word = word.trim_matches('-');
    let once = format!("mkdir -p {}\ni=$((JOB_COMPLETION_INDEX + 1))\n{}", job.folder(), job.once());
    let merge = format!("until {}; do sleep 30; done\n", job.merge);
    let pod = |script: &str, cores: u16| {
        format!(
            "      restartPolicy: Never\n      containers:\n        - name: steradian\n          image: {image}\n          workingDir: /render\n          \
             command: [sh, -c]\n          args:\n            - |\n{script}          resources:\n            requests: {{cpu: \"{cores}\"}}\n          \
             volumeMounts:\n            - {{name: render, mountPath: /render}}\n      volumes:\n        - name: render\n          \
             persistentVolumeClaim: {{claimName: {volume}}}\n",
            image = args.image,
            volume = args.volume,
            script = block(script, 14),
        )
    };
    format!(
        "# {name}: {parts} parts as an indexed Job, and a Job that merges them once all are there.\n\
         apiVersion: batch/v1\nkind: Job\nmetadata: {{name: {word}-parts}}\nspec:\n  completions: {parts}\n  parallelism: {parts}\n  \
         completionMode: Indexed\n  backoffLimitPerIndex: {tries}\n  podFailurePolicy:\n    rules:\n      # The scene is at fault: no use in trying again.\n      \
         - action: FailIndex\n        onExitCodes: {{containerName: steradian, operator: In, values: [2]}}\n  template:\n    spec:\n{parts_pod}---\n\
         apiVersion: batch/v1\nkind: Job\nmetadata: {{name: {word}-merge}}\nspec:\n  backoffLimit: {tries}\n  template:\n    spec:\n{merge_pod}",
        name = job.name,
        parts = args.parts,
        tries = args.tries,
        parts_pod = pod(&once, args.cores),
        merge_pod = pod(&merge, 1),
    )
}

/// A text as Python writes it.
fn python(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn opencue(job: &Job) -> String {
    // A frame's command is one line of words by the time that a host runs it, in a folder of the host's own.
    let once = format!("i=$1\n{}", job.once());
    format!(
        "#!/usr/bin/env python3\n\"\"\"{name}: {parts} parts as frames, then a merge, for OpenCue.\"\"\"\n\n\
         import os\nimport shlex\n\nimport outline\nimport outline.cuerun\nfrom outline.modules.shell import Shell\n\n\n\
         def shell(script):\n    here = shlex.quote(os.getcwd())\n    return [\"sh\", \"-c\", shlex.quote(f\"cd {{here}}\\n{{script}}\"), \"frame\", \"#IFRAME#\"]\n\n\n\
         os.makedirs({folder}, exist_ok=True)\njob = outline.Outline({word}, frame_range=\"1-{parts}\")\n\
         parts = Shell(\"parts\", command=shell({once}), range=\"1-{parts}\", threads={cores})\n\
         merge = Shell(\"merge\", command=shell({merge}), range=\"1-1\")\nmerge.depend_all(parts)\n\
         job.add_layer(parts)\njob.add_layer(merge)\noutline.cuerun.launch(job, use_pycuerun=False)\n",
        name = job.name,
        parts = job.args.parts,
        folder = python(&job.args.part_folder.to_string_lossy()),
        word = python(&job.name),
        once = python(&once),
        cores = job.args.cores,
        merge = python(&format!("exec {}", job.merge)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command as Verb};
    use clap::Parser;
    use std::path::Path;

    fn shell_accepts(script: &Path) -> bool {
        Command::new("sh").arg("-n").arg(script).status().is_ok_and(|s| s.success())
    }

    fn args(scheduler: &str, scene: &Path) -> SubmitArgs {
        let scene = scene.to_string_lossy();
        let line = ["steradian", "submit", scheduler, &scene, "--parts", "3", "--spp", "4", "-o", "a b.exr"];
        match Cli::try_parse_from(line).unwrap().command {
            Verb::Submit(args) => *args,
            _ => panic!("not submit"),
        }
    }

    #[test]
    fn jobs_are_text_that_their_readers_accept() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("my scene.pbrt");
        std::fs::write(&scene, "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\n")
            .unwrap();
        let job_file = dir.path().join("job");
        for scheduler in ["slurm", "parallel", "kubernetes", "opencue"] {
            let args = SubmitArgs { job: Some(job_file.clone()), quiet: true, ..args(scheduler, &scene) };
            assert_eq!(run(&args, &Console::new()).unwrap(), DONE);
            let text = std::fs::read_to_string(&job_file).unwrap();
            assert!(text.contains("--shard") && text.contains("/3") && text.contains("merge"), "{text}");
            if matches!(scheduler, "slurm" | "parallel") {
                assert!(shell_accepts(&job_file), "{text}");
            }
        }
    }

    #[test]
    fn parts_are_named_by_what_they_are_of() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("s.pbrt");
        std::fs::write(&scene, "WorldBegin\n").unwrap();
        let stem = |change: &dyn Fn(&mut SubmitArgs)| {
            let mut args = args("slurm", &scene);
            change(&mut args);
            prepare(&args, &Console::new().quiet(true)).map(|job| job.stem).unwrap()
        };
        let plain = stem(&|_| {});
        assert_eq!(plain, stem(&|a| a.cores = 7));
        assert_ne!(plain, stem(&|a| a.picture.spp = Some(5)));
        assert_ne!(plain, stem(&|a| a.picture.seed = Some(5)));
        assert_ne!(plain, stem(&|a| a.parts = 4));
        assert_ne!(plain, stem(&|a| a.aov = vec![Aov::Albedo]));
    }
}
