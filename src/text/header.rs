//! The names of a table's columns, which may end with units in brackets.

use std::collections::HashMap;

/// The column names of a vector, all in lower case, with blanks for `_` and `-`.
///
/// `components` are names of single columns, such as `x`; messages use the first ones. `names` are
/// names of the whole vector: ParaView appends the component to them, as in `Points:0`, `Points_0`
/// and `Points_X`.
pub(crate) struct Vector {
    pub components: &'static [[&'static str; 3]],
    pub names: &'static [&'static str],
}

/// The columns of a position.
pub(crate) const POSITION: Vector = Vector {
    components: &[["x", "y", "z"], ["x coordinate", "y coordinate", "z coordinate"]],
    names: &["points", "coordinates", "coordinate", "position"],
};

/// The columns of a displacement. `U` is none: flow solvers call velocities so. `delta 1` is none:
/// thicknesses of boundary layers have such names.
pub(crate) const DISPLACEMENT: Vector = Vector {
    components: &[["dx", "dy", "dz"], ["delta x", "delta y", "delta z"], ["deltax", "deltay", "deltaz"]],
    names: &["displacement", "displacements", "disp", "displ", "mesh displacement", "displacement vector"],
};

/// The columns of an original position.
pub(crate) const ORIGINAL: Vector = Vector {
    components: &[["x0", "y0", "z0"]],
    names: &[
        "original",
        "original position",
        "original positions",
        "original points",
        "original coordinates",
        "points0",
        "position0",
        "coordinates0",
        "x0",
        "initial position",
        "initial points",
        "initial coordinates",
        "undeformed",
        "reference position",
        "reference coordinates",
    ],
};

impl Vector {
    /// The component (0 to 2) in the column with this name, if any.
    fn component(&self, name: &str) -> Option<usize> {
        let name = name.to_lowercase().replace(['_', '-'], " ");
        let mut single = self.components.iter();
        if let Some(component) = single.find_map(|names| names.iter().position(|&single| single == name)) {
            return Some(component);
        }
        self.names.iter().find_map(|vector| {
            let rest = name.strip_prefix(vector)?;
            // CGNS writes `CoordinateX`.
            let rest = rest.strip_prefix([':', ' ']).unwrap_or(rest);
            ["0", "1", "2"].iter().zip(["x", "y", "z"]).position(|(&number, axis)| rest == number || rest == axis)
        })
    }

    /// Whether a header has a column of a component.
    pub fn is_in(&self, header: &Header) -> bool {
        header.names.iter().any(|name| self.component(name).is_some())
    }

    /// Whether a header has a column of one component (0 to 2).
    pub fn has(&self, header: &Header, component: usize) -> bool {
        header.names.iter().any(|name| self.component(name) == Some(component))
    }

    /// The indices of the columns of the three components in a header.
    ///
    /// # Errors
    /// A message in words: a component has no column, or two of them.
    pub fn columns(&self, header: &Header) -> Result<[usize; 3], String> {
        self.first_columns(header)
    }

    /// [`Self::columns`] of the first `N` components.
    pub fn first_columns<const N: usize>(&self, header: &Header) -> Result<[usize; N], String> {
        let header = &header.names;
        let mut columns = [None; 3];
        for (column, name) in header.iter().enumerate() {
            let Some(component) = self.component(name) else { continue };
            if let Some(first) = columns[component].replace(column) {
                let what = self.components[0][component];
                return Err(format!("the columns '{}' and '{name}' both are {what}", header[first]));
            }
        }
        let mut found = [0; N];
        for ((component, column), found) in columns.into_iter().enumerate().zip(&mut found) {
            let names = || super::shorten(&header.join(", "));
            *found =
                column.ok_or_else(|| format!("no column {} among '{}'", self.components[0][component], names()))?;
        }
        Ok(found)
    }
}

/// Letters that tell the components of a vector in the names of its columns.
const COMPONENTS: [[char; 3]; 6] =
    [['x', 'y', 'z'], ['X', 'Y', 'Z'], ['0', '1', '2'], ['1', '2', '3'], ['u', 'v', 'w'], ['U', 'V', 'W']];

/// Parts of the names of vectors that are no lengths, in lower case.
const NO_LENGTHS: &[&str] = &["normal", "velocity", "momentum", "vorticity", "friction", "force", "gradient"];

/// The longest name of a column in which components are looked for.
const LONGEST: usize = 200;

/// The names of the columns, and their units.
pub(crate) struct Header<'a> {
    pub names: Vec<&'a str>,
    /// The unit of each column, without its brackets; empty if there is none `[n names]`.
    units: Vec<&'a str>,
}

impl<'a> Header<'a> {
    /// Takes the units off the names: `x [m]`, `x(m)`. Where white space separates the columns, a
    /// unit may be a field of its own.
    pub fn of(fields: &[&'a str]) -> Self {
        let mut header = Self { names: Vec::new(), units: Vec::new() };
        for &field in fields {
            match (bracketed(field), header.units.last_mut()) {
                (Some(("", unit)), Some(before)) if before.is_empty() => *before = unit,
                (Some((name, unit)), _) if !name.is_empty() => {
                    header.names.push(name);
                    header.units.push(unit);
                }
                _ => {
                    header.names.push(field);
                    header.units.push("");
                }
            }
        }
        header
    }

    /// Triples of columns that may be a displacement under a name that is not known: names that
    /// differ in one letter, which counts the components (`ux`, `uy`, `uz`; `U:0` to `U:2`; `u1` to
    /// `u3`; `u`, `v`, `w`). Names of what cannot be a length are left out.
    pub fn unknown_vectors(&self) -> Vec<[usize; 3]> {
        let column: HashMap<&str, usize> = self.names.iter().copied().zip(0..).collect();
        let is_known = |name: &str| {
            let lower = name.to_lowercase();
            [&POSITION, &DISPLACEMENT, &ORIGINAL].iter().any(|vector| vector.component(name).is_some())
                || matches!(&*lower, "nx" | "ny" | "nz")
                || NO_LENGTHS.iter().any(|word| lower.contains(word))
        };
        let mut found = Vec::new();
        for (first, name) in self.names.iter().enumerate() {
            if name.len() > LONGEST || is_known(name) {
                continue;
            }
            let others = name.char_indices().rev().find_map(|(at, letter)| {
                let others = COMPONENTS.iter().find(|letters| letters[0] == letter)?;
                let with = |other: char| format!("{}{other}{}", &name[..at], &name[at + letter.len_utf8()..]);
                Some([*column.get(&*with(others[1]))?, *column.get(&*with(others[2]))?])
            });
            if let Some([second, third]) = others
                && !is_known(self.names[second])
                && !is_known(self.names[third])
            {
                found.push([first, second, third]);
            }
        }
        found
    }

    /// Checks that columns have one unit. idmesh does not convert lengths.
    ///
    /// # Errors
    /// A message in words: two columns have different units, or one has none.
    pub fn check_units(&self, columns: &[usize]) -> Result<(), String> {
        let Some(&first) = columns.first() else { return Ok(()) };
        let unit = |column: usize| match self.units[column] {
            "" => format!("'{}' without a unit", self.names[column]),
            unit => format!("'{}' in [{unit}]", self.names[column]),
        };
        match columns.iter().find(|&&column| self.units[column] != self.units[first]) {
            Some(&other) => Err(format!("the columns {} and {}", unit(first), unit(other))),
            None => Ok(()),
        }
    }
}

/// A name without the unit in brackets at its end, and the unit.
fn bracketed(field: &str) -> Option<(&str, &str)> {
    let (open, inside) = match field.strip_suffix(']') {
        Some(inside) => ('[', inside),
        None => ('(', field.strip_suffix(')')?),
    };
    let (name, unit) = inside.split_once(open)?;
    Some((name.trim_end(), unit.trim()))
}

/// Whether the fields of a row are column names: at least one is not empty, and none is a number.
/// The column of an index may have an empty name.
pub(crate) fn is_header(fields: &[&str]) -> bool {
    fields.iter().any(|field| !field.is_empty()) && fields.iter().all(|field| super::parse_number(field).is_none())
}

#[cfg(test)]
mod tests {
    use super::super::fields;
    use super::*;

    /// Fails if a triple goes unseen, or if positions, normals or one letter alone are taken for
    /// one.
    #[test]
    fn unknown_vectors_are_found() {
        let unknown = |header: &str| Header::of(&fields(header)).unknown_vectors();
        for header in
            ["ux,uy,uz", "UX,UY,UZ", "U:0,U:1,U:2", "u1,u2,u3", "u,v,w", "xnew,ynew,znew", "ux [m],uy [m],uz [m]"]
        {
            assert_eq!(unknown(&format!("index,x,y,z,p,{header}")), [[5, 6, 7]], "{header}");
        }
        for header in
            ["x,y,z", "x0,y0,z0", "Points:0,Points:1,Points:2", "Normals:0,Normals:1,Normals:2", "p,T,Cp1,Cp2"]
        {
            assert_eq!(unknown(header), [[0; 3]; 0], "{header}");
        }
    }

    #[test]
    fn columns_are_found_by_name() {
        let position = |header: &str| POSITION.columns(&Header::of(&fields(header)));
        assert_eq!(position("x,y,z"), Ok([0, 1, 2]));
        assert_eq!(position("\"Points:2\",\"Points:0\",\"Cp\",\"Points:1\""), Ok([1, 3, 0]));
        assert_eq!(position("Points_Magnitude;Points_0;Points_1;Points_2"), Ok([1, 2, 3]));
        assert_eq!(position("CoordinateX CoordinateY CoordinateZ"), Ok([0, 1, 2]));
        assert_eq!(position("x,y,Cz"), Err("no column z among 'x, y, Cz'".into()));
        assert_eq!(position("x,y,z,Points:1"), Err("the columns 'y' and 'Points:1' both are y".into()));
        let displacement = |header: &str| DISPLACEMENT.columns(&Header::of(&fields(header)));
        assert_eq!(displacement("dz,dy,dx,x,y,z"), Ok([2, 1, 0]));
        assert_eq!(displacement("Points:0,Displacement_Y,displacement_x,Displacement_Z"), Ok([2, 1, 3]));
        for header in
            ["x [m],y [m],z [m]", "x[m] y[m] z[m]", "x [m] y [m] z [m]", "x (m); y (m); z (m)", "X( m ),Y(m),Z(m)"]
        {
            assert_eq!(position(header), Ok([0, 1, 2]), "{header}");
            assert_eq!(Header::of(&fields(header)).check_units(&[0, 1, 2]), Ok(()), "{header}");
        }
        assert_eq!(position("Cp [-] Points:0 [m] Points:1 [m] Points:2 [m] [x]"), Ok([1, 2, 3]));
        let units = |header: &str| Header::of(&fields(header)).check_units(&[0, 1]);
        assert_eq!(units("x [m],y [mm]"), Err("the columns 'x' in [m] and 'y' in [mm]".into()));
        assert_eq!(units("x,y [mm]"), Err("the columns 'x' without a unit and 'y' in [mm]".into()));
        assert_eq!(units("x,y,z [mm]"), Ok(()));
        for header in
            ["disp:0,disp:1,disp:2", "Displ X,Displ Y,Displ Z", "delta_x,delta_y,delta_z", "DISPLX,DISPLY,DISPLZ"]
        {
            assert_eq!(displacement(header), Ok([0, 1, 2]), "{header}");
        }
        assert!(displacement("delta_1,delta_2,delta_0").is_err() && displacement("Ux,Uy,Uz").is_err());
        let header = |row: &str| is_header(&fields(row));
        assert!(header("x,y") && header(",x,y") && !header("1,x") && !header("") && !header(",,"));
    }
}
