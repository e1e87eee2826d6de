//! Makes a checked [`Case`] of a TOML document.

use std::cell::Cell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::families::{Junction, MOST_FLAT, ROLES, RigidMotion, Role, RoleOptions, RoleRow, TipStart};
use crate::mover::Settings;
use crate::profile::files::{Placement, SpanAxis};
use crate::profile::{PROFILE_MATCHES, Plane, ProfileMatch, stations};
use crate::relaxation::{Method, Stopping};
use crate::smoothing::QualityTarget;
use crate::solver_measures::{LimitError, Limits};
use crate::springs::{SPRINGS, Springs};

use super::document::{CaseDocument, TomlTable, Value};
use super::paths::{has_extension, is_pattern, matches};
use super::{Case, CaseError, FamilySettings, Output, Position, ProfileSource, paths};
use crate::formats::{SURFACE_EXTENSIONS, extension, is_surface_file, mesh_path};
use crate::text::nearest::{did_you_mean, quoted_list};

/// The keys of a case file.
pub(super) const KEYS: [&str; 7] = ["mesh", "profiles", "family", "volume", "quality", "solver", "output"];

/// The keys of its table `[output]`.
pub(super) const OUTPUT_KEYS: [&str; 5] = ["mesh", "histogram", "report", "surface", "sections"];

/// Reads the text of a case file; see [`Case::parse`].
pub(super) fn case(text: &str, path: &Path) -> Result<Case, CaseError> {
    let start = Cell::new((0, Position { line: 1, column: 1 }));
    let document = CaseDocument { path, text, last: &start };
    let table = document.parse()?;
    let top = TomlTable::top(document, table.get_ref(), &KEYS)?;
    let folder = paths::folder_of(path);

    let mesh = paths::file(&top.require("mesh", "the mesh to move, such as mesh = \"wing-body.msh\"")?, folder)?;
    let mesh = mesh_path(&mesh);
    let families = families(&top, folder)?;
    let profiles = profiles(&top, folder, &families)?;
    let volume = top.get("volume").map(|table| table.section(&["springs", "max_steps"])).transpose()?;
    let mut settings = Settings::default();
    settings.springs = springs(volume.as_ref())?;
    settings.max_steps = max_steps(volume.as_ref(), settings.max_steps)?;
    (settings.quality, settings.limits) = quality(&top, settings.quality)?;
    (settings.method, settings.stopping) = solver(&top, settings.method, settings.stopping)?;
    let output = output(&top, folder, &mesh)?;
    Ok(Case { path: path.to_path_buf(), mesh, profiles, families, settings, output })
}

fn families(top: &TomlTable, folder: &Path) -> Result<BTreeMap<String, FamilySettings>, CaseError> {
    let mut families = BTreeMap::new();
    let Some(table) = top.get("family") else { return Ok(families) };
    let mut known = vec!["role"];
    for key in ROLES.iter().flat_map(|row| row.keys) {
        if !known.contains(key) {
            known.push(key);
        }
    }
    let sections = table.sections(&known)?;
    for (name, section) in &sections {
        let role = role(section)?;
        let displacement = match role {
            Role::Prescribed => {
                let value = section.require("displacement", "a CSV file with rows x,y,z,dx,dy,dz")?;
                Some(paths::file(&value, folder)?)
            }
            _ => None,
        };
        families.insert((*name).to_owned(), FamilySettings { role, displacement, position: section.position() });
    }
    let named_by = named_by(&families);
    for (name, section) in &sections {
        if let Some(value) = section.get("partner") {
            check_partner(name, &value, &families, &named_by)?;
        }
    }
    Ok(families)
}

/// For each family, those that name it as their partner, in the order of their names.
fn named_by(families: &BTreeMap<String, FamilySettings>) -> HashMap<&str, Vec<&str>> {
    let mut named_by: HashMap<&str, Vec<&str>> = HashMap::new();
    for (name, settings) in families {
        if let Some(partner) = partner_of(settings) {
            named_by.entry(partner).or_default().push(name);
        }
    }
    named_by
}

fn partner_of(settings: &FamilySettings) -> Option<&str> {
    match &settings.role {
        Role::Plane { partner, .. } => partner.as_deref(),
        _ => None,
    }
}

/// Checks that a partner is another plane family, without a different partner of its own.
fn check_partner(
    name: &str,
    value: &Value,
    families: &BTreeMap<String, FamilySettings>,
    named_by: &HashMap<&str, Vec<&str>>,
) -> Result<(), CaseError> {
    let partner = value.text()?;
    let expected = "expected another family whose role is \"plane\"";
    let Some(settings) = families.get(partner) else {
        let known: Vec<_> = families.keys().collect();
        let advice = did_you_mean(partner, &known).unwrap_or_default();
        return Err(
            value.error(format!("`partner` is \"{partner}\", but there is no table [family.{partner}]{advice}"))
        );
    };
    if partner == name {
        return Err(value.error(format!("`{name}` is given as its own partner, {expected}")));
    }
    if !settings.role.is_plane() {
        let role = settings.role.name();
        return Err(value.error(format!("`partner` is \"{partner}\", whose role is \"{role}\", {expected}")));
    }
    // The partner may name this family alone, and no third family may name either of the two.
    let third = |target: &str| {
        let names = named_by.get(target)?;
        names.iter().copied().find(|&other| other != name && other != partner)
    };
    let own = partner_of(settings).filter(|&theirs| theirs != name).map(|_| partner);
    if let Some(other) = [own, third(partner), third(name)].into_iter().flatten().min() {
        let settings = &families[other];
        return Err(value.error(format!(
            "`partner` is \"{partner}\", but `{other}` is given the partner `{}` (line {}), expected pairs",
            partner_of(settings).unwrap_or_default(),
            settings.position.line
        )));
    }
    Ok(())
}

fn role(section: &TomlTable) -> Result<Role, CaseError> {
    let names: Vec<_> = ROLES.iter().map(|row| row.name).collect();
    let value = section.require("role", &format!("one of {}", quoted_list(&names)))?;
    let name = match value.text() {
        Ok(alias) if RoleRow::named(alias).is_some() => alias,
        text => value.one_of(&names).map_err(|error| match text.map(RoleRow::called).as_deref() {
            Ok([]) | Err(_) => error,
            Ok(meant) => error.with_advice(&format!("; did you mean {}?", quoted_list(meant))),
        })?,
    };
    let row = RoleRow::named(name).expect("it is one of the names");
    for key in ROLES.iter().flat_map(|owner| owner.keys).filter(|key| !row.keys.contains(key)) {
        if let Some(value) = section.get(key) {
            let owners = ROLES.iter().filter(|owner| owner.keys.contains(key));
            let owners: Vec<String> = owners.map(|owner| format!("\"{}\"", owner.name)).collect();
            return Err(value.key_error(format!(
                "`{key}` does not fit role \"{}\", expected only in a family whose role is {}",
                row.name,
                owners.join(" or ")
            )));
        }
    }
    let start = match section.get("start").map(|value| value.one_of(&["affine", "rigid", "original"])).transpose()? {
        None => None,
        Some("affine") => Some(TipStart::Affine),
        Some("rigid") => Some(TipStart::Rigid),
        Some(_) => Some(TipStart::Original),
    };
    let options = RoleOptions {
        coefficient: section.get("coefficient").map(|value| in_unit_interval(&value)).transpose()?,
        start,
        junction: match section.get("junction").map(|value| value.one_of(&["glued", "slide"])).transpose()? {
            Some("slide") => Junction::Slide,
            _ => Junction::Glued,
        },
        motion: section.get("motion").map(|value| motion(&value)).transpose()?.unwrap_or_default(),
        flat: section.get("flat").map(|value| flat(&value)).transpose()?,
        partner: section.get("partner").map(|value| value.text().map(str::to_owned)).transpose()?,
    };
    Ok((row.make)(options))
}

/// The motion of a rigid family: a name, or a table of a turn and a shift.
fn motion(value: &Value) -> Result<RigidMotion, CaseError> {
    const NAMES: [&str; 3] = ["root", "translation", "none"];
    if value.is_table() {
        let table = value.section(&["turn", "about", "shift"])?;
        let vector = |key: &str| table.get(key).map(|value| value.position().map(DVec3::from)).transpose();
        let motion = RigidMotion::given(vector("turn")?, vector("about")?, vector("shift")?);
        return motion.map_err(|why| value.error(format!("`motion` {why}")));
    }
    match value.text() {
        Ok("root") => Ok(RigidMotion::Root),
        Ok("translation") => Ok(RigidMotion::Translation),
        Ok("none") => Ok(RigidMotion::None),
        _ => value
            .one_of(&NAMES)
            .map(|_| RigidMotion::Root)
            .map_err(|error| error.with_advice("; a motion of its own is a table, such as { shift = [0, 0, -0.05] }")),
    }
}

fn in_unit_interval(value: &Value) -> Result<f64, CaseError> {
    let number = value.number()?;
    if (0.0..=1.0).contains(&number) {
        return Ok(number);
    }
    Err(value.error(format!("`coefficient` is {number}, expected 0 (rigid) to 1 (freely deformable)")))
}

fn flat(value: &Value) -> Result<f64, CaseError> {
    let number = value.number()?;
    if number > 0.0 && number <= MOST_FLAT {
        return Ok(number);
    }
    Err(value
        .error(format!("`flat` is {number}, expected a fraction of the family's size, above 0 and up to {MOST_FLAT}")))
}

fn profiles(
    top: &TomlTable,
    folder: &Path,
    families: &BTreeMap<String, FamilySettings>,
) -> Result<BTreeMap<String, ProfileSource>, CaseError> {
    let mut profiles = BTreeMap::new();
    let patterns: Vec<&String> = families.keys().filter(|table| is_pattern(table)).collect();
    let sections = match top.get("profiles") {
        Some(table) => table.sections(&["families", "new", "old", "placement", "mirror", "match"])?,
        None => Vec::new(),
    };
    for (name, section) in sections {
        let members = match section.get("families") {
            Some(value) => members(&value)?,
            None => vec![name.to_owned()],
        };
        for member in &members {
            match families.get(member).map(|family| &family.role) {
                Some(Role::Wing) => {}
                Some(role) => return Err(section.error(super::families::no_wing(member, role))),
                // Only the mesh gives the families of a pattern.
                None if is_pattern(member) || patterns.iter().any(|table| matches(table, member)) => {}
                None => {
                    let known: Vec<_> = families.keys().collect();
                    let advice = did_you_mean(member, &known).unwrap_or_default();
                    return Err(section.error(format!(
                        "profiles are given for family `{member}`, but there is no table [family.{member}]{advice}"
                    )));
                }
            }
        }
        let mirror = section.get("mirror").map(|value| mirror(&value)).transpose()?;
        let matched =
            section.get("match").map(|value| value.one_of(&PROFILE_MATCHES.map(|(name, _)| name))).transpose()?;
        let matched = matched.and_then(ProfileMatch::named);
        let new = section.require("new", "a profile file, a list of them, or a pattern such as \"new/*.dat\"")?;
        let new = paths::files(&new, folder)?;
        let old = section.get("old").map(|value| paths::files(&value, folder)).transpose()?;
        let mut placements = BTreeMap::new();
        if let Some(table) = section.get("placement") {
            let files: HashSet<&PathBuf> = new.iter().chain(old.iter().flatten()).collect();
            for (file, sections) in table.lists_of_sections(&["chord", "twist", "position", "plane"])? {
                let path = folder.join(file);
                if !files.contains(&path) {
                    return Err(sections[0].error(format!(
                        "a placement is given for \"{file}\", which is none of the profile files of `{name}`"
                    )));
                }
                placements.insert(path, sections.iter().map(placement).collect::<Result<Vec<_>, _>>()?);
            }
        }
        let position = section.position();
        profiles.insert(
            name.to_owned(),
            ProfileSource { families: members, mirror, matched, position, new, old, placements },
        );
    }
    let members = || profiles.values().flat_map(|source: &ProfileSource| &source.families);
    let names: HashSet<&String> = members().collect();
    let patterns: Vec<&String> = members().filter(|member| is_pattern(member)).collect();
    let belongs = |name: &String| names.contains(name) || patterns.iter().any(|member| matches(member, name));
    // Two patterns may fit a common family, and only the mesh shows this. So patterns are not
    // checked here.
    let without =
        families.iter().filter(|(name, family)| family.role == Role::Wing && !is_pattern(name) && !belongs(name));
    if let Some((name, family)) = without.min_by_key(|(_, family)| family.position.line) {
        let message = super::families::no_profiles(name);
        return Err(CaseError::Invalid { path: top.path().to_path_buf(), position: family.position, message });
    }
    Ok(profiles)
}

/// The families of a wing, or patterns for them, each once.
fn members(value: &Value) -> Result<Vec<String>, CaseError> {
    let mut members: Vec<String> = Vec::new();
    for entry in value.texts_or("family")? {
        let member = entry.text()?;
        if members.iter().any(|other| other == member) {
            return Err(entry.error(format!("`families` has `{member}` twice, expected each family once")));
        }
        members.push(member.to_owned());
    }
    Ok(members)
}

/// A mirror plane, given by a coordinate axis across the plane, with or without a place, or by a
/// point and a normal.
fn mirror(value: &Value) -> Result<Plane, CaseError> {
    if let Ok(text) = value.text() {
        let at = if text.contains('=') { text.to_owned() } else { format!("{text}=0") };
        return stations::parse(&at).map_err(|_| {
            value.error(format!(
                "`mirror` is \"{text}\", expected \"x\", \"y\" or \"z\", such a plane's place as in \"y=0.5\", or {{ point = \
                 [0, 0, 0], normal = [0, 1, 0] }}"
            ))
        });
    }
    let section = value.section(&["point", "normal"])?;
    let vector =
        |key: &str| -> Result<DVec3, CaseError> { Ok(section.require(key, "three numbers")?.position()?.into()) };
    let (point, normal) = (vector("point")?, vector("normal")?);
    let Some(normal) = normal.try_normalize() else {
        return Err(value.error("`mirror.normal` has no direction, expected one across the mirror plane"));
    };
    Ok(Plane { point, normal })
}

/// The placement of an airfoil: chord and position in the mesh's unit, twist in degrees.
fn placement(section: &TomlTable) -> Result<Placement, CaseError> {
    let chord = section.require("chord", "the length of the chord")?;
    let length = chord.number()?;
    if !(length > 0.0 && length.is_finite()) {
        return Err(chord.error(format!("`chord` is {length}, expected a length above 0")));
    }
    let twist = match section.get("twist") {
        None => 0.0,
        Some(value) => match value.number()? {
            twist if twist.is_finite() => twist,
            twist => return Err(value.error(format!("`twist` is {twist}, expected degrees, nose up"))),
        },
    };
    let position = section.require("position", "the place of the leading edge, such as [0.0, 1.5, 0.0]")?.position()?;
    let span = match section.get("plane").map(|value| value.one_of(&["y", "z"])).transpose()? {
        None | Some("y") => SpanAxis::Y,
        Some(_) => SpanAxis::Z,
    };
    Ok(Placement { chord: length, twist, position: position.into(), span })
}

fn springs(volume: Option<&TomlTable>) -> Result<&'static Springs, CaseError> {
    let names: Vec<_> = SPRINGS.iter().map(|springs| springs.name).collect();
    let name = volume.and_then(|section| section.get("springs")).map(|value| value.one_of(&names)).transpose()?;
    Ok(name.and_then(Springs::named).unwrap_or_default())
}

fn max_steps(volume: Option<&TomlTable>, default: usize) -> Result<usize, CaseError> {
    volume.and_then(|section| section.get("max_steps")).map_or(Ok(default), |value| value.count())
}

/// The target of local optimisation, where `None` stands for "off", and the limits of the moved
/// mesh.
fn quality(top: &TomlTable, default: Option<QualityTarget>) -> Result<(Option<QualityTarget>, Limits), CaseError> {
    let table = top.get("quality").map(|table| table.section(&["target", "limits"])).transpose()?;
    let Some(table) = table else { return Ok((default, Limits::default())) };
    let target = match table.get("target").map(|value| value.one_of(&["original", "improve", "off"])).transpose()? {
        None => default,
        Some("original") => Some(QualityTarget::Original),
        Some("improve") => Some(QualityTarget::Improve),
        Some(_) => None,
    };
    Ok((target, table.get("limits").map_or(Ok(Limits::default()), |value| limits(&value))?))
}

/// Limits on the measures of solvers: those of a solver by its name, or a table of values.
fn limits(value: &Value) -> Result<Limits, CaseError> {
    if !value.is_table() {
        return value.one_of(&["openfoam"]).map(|_| Limits::openfoam());
    }
    let mut limits = Limits::default();
    for (name, value) in value.children()? {
        limits.set(name, value.number()?).map_err(|error| match error {
            LimitError::Unknown { .. } => value.key_error(error.to_string()),
            LimitError::OutOfRange { .. } => value.error(error.to_string()),
        })?;
    }
    Ok(limits)
}

/// The method and the stopping rule of the table `[solver]`. Keys that the table leaves out get the
/// values of the arguments.
fn solver(top: &TomlTable, method: Method, stopping: Stopping) -> Result<(Method, Stopping), CaseError> {
    let (mut method, mut stopping) = (method, stopping);
    let Some(table) = top.get("solver") else { return Ok((method, stopping)) };
    let section = table.section(&["method", "tolerance", "max_sweeps"])?;
    if let Some(value) = section.get("method") {
        method = match value.one_of(&["auto", "jacobi", "chebyshev", "multigrid"])? {
            "jacobi" => Method::Jacobi,
            "chebyshev" => Method::Chebyshev,
            "multigrid" => Method::Multigrid,
            _ => Method::Auto,
        };
    }
    if let Some(value) = section.get("tolerance") {
        stopping.tolerance = value.number()?;
        if !(stopping.tolerance > 0.0 && stopping.tolerance.is_finite()) {
            let message =
                format!("`solver.tolerance` is {}, expected a number above 0, such as 1e-4", stopping.tolerance);
            return Err(value.error(message));
        }
    }
    if let Some(value) = section.get("max_sweeps") {
        stopping.max_sweeps = value.count()?;
    }
    Ok((method, stopping))
}

fn output(top: &TomlTable, folder: &Path, mesh: &Path) -> Result<Output, CaseError> {
    let section = top.get("output").map(|table| table.section(&OUTPUT_KEYS)).transpose()?;
    let mut output = Output { mesh: vec![folder.join(default_name(mesh))], ..Output::default() };
    let Some(section) = section else { return Ok(output) };
    if let Some(value) = section.get("mesh") {
        output.mesh.clear();
        for entry in value.texts()? {
            let file = folder.join(entry.text()?);
            if file == mesh {
                return Err(
                    entry.error(format!("the output \"{}\" is the input mesh, expected another name", entry.text()?))
                );
            }
            if output.mesh.contains(&file) {
                return Err(entry.error(format!("the output \"{}\" is listed twice", entry.text()?)));
            }
            output.mesh.push(file);
        }
    }
    output.histogram = other_output(&section, "histogram", "svg", folder)?;
    output.report = other_output(&section, "report", "html", folder)?;
    output.sections = other_output(&section, "sections", "svg", folder)?;
    if let Some(value) = section.get("surface") {
        for entry in value.texts()? {
            let (text, file) = (entry.text()?, paths::file(&entry, folder)?);
            if !is_surface_file(&file) {
                return Err(entry
                    .error(format!("`output.surface` is \"{text}\", expected a name ending in {SURFACE_EXTENSIONS}")));
            }
            if output.surface.contains(&file) {
                return Err(entry.error(format!("the output \"{text}\" is listed twice")));
            }
            output.surface.push(file);
        }
    }
    Ok(output)
}

/// An output that is no mesh: a file with this extension.
fn other_output(section: &TomlTable, key: &str, extension: &str, folder: &Path) -> Result<Option<PathBuf>, CaseError> {
    let Some(value) = section.get(key) else { return Ok(None) };
    let file = paths::file(&value, folder)?;
    if !has_extension(&file, extension) {
        let found = value.text()?;
        return Err(value.error(format!("`output.{key}` is \"{found}\", expected a name ending in .{extension}")));
    }
    Ok(Some(file))
}

/// The output's default name: `moved` with the input's extension. An extension may have several
/// parts, so `wing.lb8.ugrid.gz` gives `moved.lb8.ugrid.gz`.
pub(crate) fn default_name(mesh: &Path) -> String {
    let name = mesh.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let parts: Vec<&str> = name.split('.').collect();
    let of_format = extension(mesh).map_or(1, |extension| extension.split('.').count());
    let zipped = usize::from(parts.len() > 2 && parts[parts.len() - 1].eq_ignore_ascii_case("gz"));
    let kept = (of_format + zipped).min(parts.len() - 1);
    std::iter::once("moved").chain(parts[parts.len() - kept..].iter().copied()).collect::<Vec<_>>().join(".")
}
