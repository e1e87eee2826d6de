//! The names of a table's columns.

/// The column names of a vector, all in lower case.
///
/// `components` are names of single columns, such as `x`. `names` are names of the whole vector:
/// ParaView appends the component to them, as in `Points:0`, `Points_0` and `Points_X`.
pub(crate) struct Vector {
    pub components: [&'static str; 3],
    pub names: &'static [&'static str],
}

/// The columns of a position.
pub(crate) const POSITION: Vector =
    Vector { components: ["x", "y", "z"], names: &["points", "coordinates", "coordinate", "position"] };

/// The columns of a displacement.
pub(crate) const DISPLACEMENT: Vector =
    Vector { components: ["dx", "dy", "dz"], names: &["displacement", "displacements"] };

impl Vector {
    /// The component (0 to 2) in the column with this name, if any.
    fn component(&self, name: &str) -> Option<usize> {
        let name = name.to_lowercase();
        if let Some(component) = self.components.iter().position(|&component| component == name) {
            return Some(component);
        }
        let rest = self.names.iter().find_map(|vector| name.strip_prefix(vector))?;
        // CGNS writes `CoordinateX`.
        let rest = rest.strip_prefix([':', '_', '-', ' ']).unwrap_or(rest);
        ["0", "1", "2"].iter().zip(["x", "y", "z"]).position(|(&number, axis)| rest == number || rest == axis)
    }

    /// The indices of the columns of the three components in a header.
    ///
    /// # Errors
    /// A message in words: a component has no column, or two of them.
    pub fn columns(&self, header: &[&str]) -> Result<[usize; 3], String> {
        let mut columns = [None; 3];
        for (column, name) in header.iter().enumerate() {
            let Some(component) = self.component(name) else { continue };
            if let Some(first) = columns[component].replace(column) {
                let what = self.components[component];
                return Err(format!("the columns '{}' and '{name}' both are {what}", header[first]));
            }
        }
        let mut found = [0; 3];
        for (component, column) in columns.into_iter().enumerate() {
            let names = || super::shorten(&header.join(", "));
            found[component] =
                column.ok_or_else(|| format!("no column {} among '{}'", self.components[component], names()))?;
        }
        Ok(found)
    }
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

    #[test]
    fn columns_are_found_by_name() {
        let position = |header: &str| POSITION.columns(&fields(header));
        assert_eq!(position("x,y,z"), Ok([0, 1, 2]));
        assert_eq!(position("\"Points:2\",\"Points:0\",\"Cp\",\"Points:1\""), Ok([1, 3, 0]));
        assert_eq!(position("Points_Magnitude;Points_0;Points_1;Points_2"), Ok([1, 2, 3]));
        assert_eq!(position("CoordinateX CoordinateY CoordinateZ"), Ok([0, 1, 2]));
        assert_eq!(position("x,y,Cz"), Err("no column z among 'x, y, Cz'".into()));
        assert_eq!(position("x,y,z,Points:1"), Err("the columns 'y' and 'Points:1' both are y".into()));
        let displacement = |header: &str| DISPLACEMENT.columns(&fields(header));
        assert_eq!(displacement("dz,dy,dx,x,y,z"), Ok([2, 1, 0]));
        assert_eq!(displacement("Points:0,Displacement_Y,displacement_x,Displacement_Z"), Ok([2, 1, 3]));
        let header = |row: &str| is_header(&fields(row));
        assert!(header("x,y") && header(",x,y") && !header("1,x") && !header("") && !header(",,"));
    }
}
