//! `osculate micro`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use osculate_render::output::write_png;
use osculate_render::picture;
use osculate_sbtf::micro::import::{save_maps, save_spec};
use osculate_sbtf::micro::measured::measure;
use osculate_sbtf::micro::preview::{PreviewOptions, preview};
use osculate_sbtf::micro::{BUILTINS, Geometry, HeightField, MicroReport, Microstructure, SeamReport};
use osculate_sbtf::photographs::{PhotographOptions, photographs, save_photographs};
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, number};
use crate::output;
use crate::report::Reporter;

/// Show a material: depth, slopes, seams, a picture, its maps; or make one from photographs.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate micro --list
  osculate micro stone-1 -o stone.png               a picture of two by two tiles
  osculate micro mine.toml --json - | jq .micro.field.seam
  osculate micro cave --maps maps                   height, albedo, roughness and metalness as PNG
  osculate micro cave --photographs photos          as a camera above it sees it under twelve lights
  osculate micro --measured photos -o mine.toml     from photographs under known lights")]
pub struct MicroArgs {
    /// A procedural material or a .toml file
    #[arg(value_name = "NAME|FILE", required_unless_present_any = ["list", "measured"], conflicts_with_all = ["list", "measured"])]
    micro: Option<String>,
    /// List the procedural materials
    #[arg(long, conflicts_with = "measured")]
    list: bool,
    /// A directory with images and lights.toml or lights.txt
    #[arg(long, value_name = "DIR")]
    measured: Option<PathBuf>,
    /// The picture (.png); with --measured also the material (.toml, with its maps beside it)
    #[arg(short, value_name = "OUT", conflicts_with = "list")]
    output: Option<PathBuf>,
    /// Pixels along each side of the picture
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u16).range(16..=4096))]
    size: u16,
    /// Tiles along each side of the picture
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=8))]
    tiles: u8,
    /// Write the maps of a height field into DIR, which is made if need be, with a material.toml
    #[arg(long, value_name = "DIR", conflicts_with = "list")]
    maps: Option<PathBuf>,
    /// Render a height field from above under twelve lights, --size texels a side, into DIR, which is made if need be, with a lights.toml:
    /// what --measured reads
    #[arg(long, value_name = "DIR", conflicts_with_all = ["list", "measured"])]
    photographs: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<Listed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    micro: Option<&'a MicroReport>,
    /// Of the file, before any mirroring.
    #[serde(skip_serializing_if = "Option::is_none")]
    seam: Option<SeamReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<MeasuredReport>,
    warnings: &'a [String],
    output: Option<String>,
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    about: &'static str,
}

#[derive(Clone, Copy, Serialize)]
struct MeasuredReport {
    images: usize,
    residual: f32,
    left_out: f32,
}

/// What there is to show.
struct Loaded {
    micro: Microstructure,
    warnings: Vec<String>,
    seam: Option<SeamReport>,
    measured: Option<MeasuredReport>,
}

/// Runs the command.
pub fn run(args: &MicroArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    if args.list {
        return list(console, reporter);
    }
    check_output(args)?;
    let loaded = load(args, console)?;
    for warning in &loaded.warnings {
        console.warn(warning);
    }
    if args.maps.is_some() || args.photographs.is_some() {
        // Before anything is printed.
        height_field(&loaded.micro)?;
    }
    let report = MicroReport::new(&loaded.micro);
    print(&report, loaded.seam.as_ref(), loaded.measured.as_ref(), console);
    write(args, &loaded.micro, console)?;
    let output = args.output.as_ref().map(|path| path.display().to_string());
    let Loaded { warnings, seam, measured, .. } = &loaded;
    let body = Report {
        materials: Vec::new(),
        micro: Some(&report),
        seam: *seam,
        measured: *measured,
        warnings,
        output,
    };
    reporter.write("micro", 1, &body)?;
    Ok(Outcome::Done)
}

fn list(console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let materials: Vec<Listed> = BUILTINS.iter().map(|b| Listed { name: b.name, about: b.about }).collect();
    for Listed { name, about } in &materials {
        console.result(format_args!("  {name:<20} {about}"));
    }
    let body = Report { materials, micro: None, seam: None, measured: None, warnings: &[], output: None };
    reporter.write("micro", 1, &body)?;
    Ok(Outcome::Done)
}

fn check_output(args: &MicroArgs) -> Result<()> {
    if let Some(path) = &args.output {
        output::check(path)?;
        match (output::extension(path).as_str(), &args.measured) {
            ("png", _) | ("toml", Some(_)) => {}
            (_, None) => bail!("{}: a picture is a .png; name it so", path.display()),
            (_, Some(_)) => bail!("{}: is neither a .toml nor a .png", path.display()),
        }
    }
    for directory in [&args.maps, &args.photographs].into_iter().flatten() {
        if directory.exists() && !directory.is_dir() {
            bail!("{}: is no directory", directory.display());
        }
    }
    Ok(())
}

fn load(args: &MicroArgs, console: &Console) -> Result<Loaded> {
    if let Some(directory) = &args.measured {
        let _step = console.step(&format!("measuring {}", directory.display()));
        let measured = measure(directory)?;
        let report = MeasuredReport {
            images: measured.images,
            residual: measured.residual,
            left_out: measured.left_out,
        };
        let (micro, warnings) = (measured.micro, measured.warnings);
        return Ok(Loaded { micro, warnings, seam: None, measured: Some(report) });
    }
    let name = args.micro.as_deref().unwrap_or_default();
    let _step = console.step(&format!("reading {name}"));
    let imported = Microstructure::load(name)?;
    let (micro, warnings, seam) = (imported.micro, imported.warnings, imported.seam);
    Ok(Loaded { micro, warnings, seam, measured: None })
}

fn print(
    report: &MicroReport,
    seam: Option<&SeamReport>,
    measured: Option<&MeasuredReport>,
    console: &Console,
) {
    let f = |x: f32| number(f64::from(x));
    console.result(&report.name);
    console.result(format_args!(
        "  depth      {}, from z = {} to {}",
        f(report.depth),
        f(report.z[0]),
        f(report.z[1])
    ));
    if let Some(field) = &report.field {
        let [width, height] = field.size;
        console.result(format_args!(
            "  heights    {width} x {height} texels, mean {:.3} of the depth",
            field.mean_height
        ));
        let slope = &field.slope_degrees;
        console.result(format_args!(
            "  slopes     {:.1} degrees (median), {:.1} (95 %), {:.1} (steepest)",
            slope.median, slope.p95, slope.max
        ));
    }
    if let Some(seam) = seam.or(report.field.as_ref().map(|field| &field.seam)) {
        console.result(format_args!(
            "  seam       {:.2} times the jumps inside along u, {:.2} along v",
            seam.u.ratio, seam.v.ratio
        ));
    }
    if let Some(mesh) = &report.mesh {
        console.result(format_args!(
            "  mesh       {} triangles, {:.1} % of the tile is see-through from above",
            mesh.triangles,
            100.0 * mesh.see_through
        ));
    }
    if let Some(measured) = measured {
        console.result(format_args!(
            "  measured   from {} images; {:.2} % of the brightness is not explained, {:.1} % of the observations are left out",
            measured.images,
            100.0 * measured.residual,
            100.0 * measured.left_out
        ));
    }
    console.result(format_args!("  SHA-256    {}", report.hash));
}

fn write(args: &MicroArgs, micro: &Microstructure, console: &Console) -> Result<()> {
    if let Some(path) = &args.output {
        if output::extension(path) == "toml" {
            write_material(micro, path)?;
        } else {
            let _step = console.step("taking the picture");
            let size = usize::from(args.size);
            let options = PreviewOptions { size, tiles: f32::from(args.tiles), ..PreviewOptions::default() };
            let linear = preview(micro, &options);
            let side = u32::from(args.size);
            write_png(path, &picture(side, side, &linear, 0.0))
                .with_context(|| path.display().to_string())?;
        }
        console.result(format_args!("  {}", path.display()));
    }
    if let Some(directory) = &args.maps {
        let field = height_field(micro)?;
        std::fs::create_dir_all(directory).with_context(|| directory.display().to_string())?;
        let spec = save_maps(field, directory, "").with_context(|| directory.display().to_string())?;
        save_spec(&spec, &directory.join("material.toml"))
            .with_context(|| directory.display().to_string())?;
        console.result(format_args!("  {}: maps and material.toml", directory.display()));
    }
    if let Some(directory) = &args.photographs {
        let options = PhotographOptions { size: args.size.into(), ..PhotographOptions::default() };
        let images = {
            let _step = console.step("taking photographs");
            photographs(height_field(micro)?, &options)
        };
        std::fs::create_dir_all(directory).with_context(|| directory.display().to_string())?;
        save_photographs(&images, &options, directory).with_context(|| directory.display().to_string())?;
        console.result(format_args!(
            "  {}: {} photographs and lights.toml",
            directory.display(),
            images.len()
        ));
    }
    Ok(())
}

/// The maps go beside the specification, with its name before theirs.
fn write_material(micro: &Microstructure, path: &Path) -> Result<()> {
    let directory = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let prefix = format!("{}_", path.file_stem().unwrap_or_default().to_string_lossy());
    let spec =
        save_maps(height_field(micro)?, directory, &prefix).with_context(|| path.display().to_string())?;
    save_spec(&spec, path).with_context(|| path.display().to_string())
}

fn height_field(micro: &Microstructure) -> Result<&HeightField> {
    match &micro.geometry {
        Geometry::HeightField(field) => Ok(field),
        Geometry::TileMesh(_) => {
            bail!("{}: is a mesh and no height field; leave --maps and --photographs out", micro.name)
        }
    }
}
