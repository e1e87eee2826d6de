//! Roles of families: names, or mappings with the keys of a case file's table.

use std::collections::BTreeMap;

use idmesh::DVec3;
use idmesh::families::{Junction, ROLES, RigidMotion, Role, RoleOptions, RoleRow, TipStart};
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyString};

use crate::errors::input;

/// The roles in a mapping from families to roles.
///
/// # Errors
/// `InputError`: a role or a key of a role is unknown, or a value is none that the key takes.
pub fn parse(roles: &Bound<'_, PyMapping>) -> PyResult<BTreeMap<String, Role>> {
    let mut found = BTreeMap::new();
    for item in roles.items()?.iter() {
        let (family, role): (String, Bound<'_, PyAny>) = item.extract()?;
        let role = one(&family, &role)?;
        found.insert(family, role);
    }
    Ok(found)
}

fn one(family: &str, given: &Bound<'_, PyAny>) -> PyResult<Role> {
    let py = given.py();
    let wrong = |message: String| input(py, &format!("the role of `{family}`: {message}"));
    if let Ok(name) = given.cast::<PyString>() {
        return Ok((row(name.to_str()?).map_err(wrong)?.make)(RoleOptions::default()));
    }
    let Ok(table) = given.cast::<PyMapping>() else {
        return Err(wrong("expected a name, or a mapping with the key \"role\"".to_owned()));
    };
    let Ok(name) = table.get_item("role").and_then(|name| name.extract::<String>()) else {
        return Err(wrong("the mapping has no name under the key \"role\"".to_owned()));
    };
    let row = row(&name).map_err(wrong)?;
    let mut options = RoleOptions::default();
    for item in table.items()?.iter() {
        let (key, value): (String, Bound<'_, PyAny>) = item.extract()?;
        let number = || value.extract::<f64>().map_err(|_| wrong(format!("`{key}` is no number")));
        let text = || value.extract::<String>().map_err(|_| wrong(format!("`{key}` is no name")));
        match key.as_str() {
            "role" => {}
            "displacement" => {
                return Err(wrong("give the displacements to `update`, by the family's name".to_owned()));
            }
            key if !row.keys.contains(&key) => {
                let known: Vec<String> = ["role"].iter().chain(row.keys).map(|known| format!("\"{known}\"")).collect();
                return Err(wrong(format!("unknown key \"{key}\", expected {}", known.join(", "))));
            }
            "coefficient" => options.coefficient = Some(number()?),
            "flat" => options.flat = Some(number()?),
            "partner" => options.partner = Some(text()?),
            "start" => {
                options.start = match text()?.as_str() {
                    "affine" => Some(TipStart::Affine),
                    "rigid" => Some(TipStart::Rigid),
                    "original" => Some(TipStart::Original),
                    other => {
                        let expected = "expected \"affine\", \"rigid\" or \"original\"";
                        return Err(wrong(format!("`start` is \"{other}\", {expected}")));
                    }
                }
            }
            "junction" => {
                options.junction = match text()?.as_str() {
                    "glued" => Junction::Glued,
                    "slide" => Junction::Slide,
                    other => {
                        return Err(wrong(format!("`junction` is \"{other}\", expected \"glued\" or \"slide\"")));
                    }
                }
            }
            "motion" => options.motion = motion(&value).map_err(wrong)?,
            other => return Err(wrong(format!("the key \"{other}\" cannot be given here"))),
        }
    }
    Ok((row.make)(options))
}

/// The motion of a rigid family: a name, or a mapping with a turn and a shift.
fn motion(value: &Bound<'_, PyAny>) -> Result<RigidMotion, String> {
    let expected = "expected \"root\", \"translation\", \"none\", or a mapping such as {\"shift\": [0, 0, -0.05]}";
    if let Ok(name) = value.extract::<String>() {
        return match name.as_str() {
            "root" => Ok(RigidMotion::Root),
            "translation" => Ok(RigidMotion::Translation),
            "none" => Ok(RigidMotion::None),
            other => Err(format!("`motion` is \"{other}\", {expected}")),
        };
    }
    let given: BTreeMap<String, [f64; 3]> = value
        .extract()
        .map_err(|_| format!("`motion` is neither a name nor a mapping of three numbers, {expected}"))?;
    if let Some(key) = given.keys().find(|key| !["turn", "about", "shift"].contains(&key.as_str())) {
        return Err(format!("unknown key \"{key}\" in `motion`, expected \"turn\", \"about\" or \"shift\""));
    }
    let vector = |key: &str| given.get(key).copied().map(DVec3::from);
    RigidMotion::given(vector("turn"), vector("about"), vector("shift")).map_err(|why| format!("`motion` {why}"))
}

fn row(name: &str) -> Result<&'static RoleRow, String> {
    RoleRow::named(name).ok_or_else(|| {
        let known: Vec<String> = ROLES.iter().map(|row| format!("\"{}\"", row.name)).collect();
        format!("\"{name}\" is no role, expected one of {}", known.join(", "))
    })
}
