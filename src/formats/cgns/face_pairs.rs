//! 1-to-1 connectivity that is given on faces.
//!
//! The connectivity names pairs of faces, not pairs of points. The points of two faces are paired
//! by their distances: a face has as many ways onto another one as it has corners, in both
//! directions.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::DVec3;

use super::elements::{Reader, Vertices};
use super::join::ZonePoints;
use super::tree::Node;
use crate::formats::error::ReadError;

/// The faces of the zones, each zone read when it is first asked for.
#[derive(Default)]
pub(super) struct ZoneFaces<'a> {
    of_zone: HashMap<usize, Reader<'a>>,
}

impl<'a> ZoneFaces<'a> {
    /// Reads the zone with this index, if it has not been read.
    ///
    /// # Errors
    /// [`ReadError`]
    pub fn read(&mut self, index: usize, zone: &ZonePoints<'a>) -> Result<(), ReadError> {
        if let Entry::Vacant(entry) = self.of_zone.entry(index) {
            let mut reader = Reader::new(zone.zone.source.path);
            reader.zone(zone.zone, Vertices { count: zone.positions.len(), of_mesh: None })?;
            entry.insert(reader);
        }
        Ok(())
    }

    /// The points of a face of a zone that was read.
    fn points(&self, zone: usize, number: i64) -> Option<&[u32]> {
        let Reader { mesh_builder, faces: [triangles, quadrilaterals], .. } = self.of_zone.get(&zone)?;
        let place = |faces: &[(i64, usize)]| faces.binary_search_by_key(&number, |&(face, _)| face).ok();
        match place(triangles) {
            Some(place) => mesh_builder.triangles.get(place).map(|face| &face[..]),
            None => mesh_builder.others.quadrilaterals.get(place(quadrilaterals)?).map(|face| &face[..]),
        }
    }
}

/// The faces of a connection in one of its two zones.
pub(super) struct Side<'a> {
    /// Index of the zone.
    pub zone: usize,
    pub points: &'a ZonePoints<'a>,
    /// The node with the numbers of the faces.
    pub node: Node<'a>,
    pub numbers: Vec<i64>,
}

/// The pairs of points of two zones whose faces are pairs. `most` is the greatest distance of the
/// two points of a pair.
///
/// # Errors
/// [`ReadError::Malformed`]: a number is no face, faces have other shapes or places than their
/// partners, or a point could be either of two.
pub(super) fn pairs_of_points(
    connection: &Node,
    faces: &ZoneFaces,
    [own, other]: [&Side; 2],
    most: f64,
) -> Result<Vec<[usize; 2]>, ReadError> {
    let face = |side: &Side, number: i64| match faces.points(side.zone, number) {
        Some(points) => Ok(points.to_vec()),
        None => Err(side.node.malformed(
            format!("triangles or quadrilaterals of {}", side.points.zone.path()),
            format_args!("{number}; save the faces between zones, or the connectivity on vertices"),
        )),
    };
    let mut partner: HashMap<u32, u32> = HashMap::new();
    let mut pairs = Vec::new();
    for (&a, &b) in own.numbers.iter().zip(&other.numbers) {
        let (of_own, of_other) = (face(own, a)?, face(other, b)?);
        let at = |point: u32| own.points.positions[point as usize];
        let at_other = |point: u32| other.points.positions[point as usize];
        if of_own.len() != of_other.len() {
            let found = format!("face {a} with {} corners and face {b} with {}", of_own.len(), of_other.len());
            return Err(connection.malformed("pairs of faces with as many corners", found));
        }
        let matched = nearest_way(&of_own, &of_other, at, at_other);
        for (&own, &other) in of_own.iter().zip(&matched) {
            let distance = at(own).distance(at_other(other));
            if distance.is_nan() || distance > most {
                let found = format!("{} of face {a} and {} of face {b}", at(own), at_other(other));
                return Err(connection.malformed("points of two zones at the same place", found));
            }
            let is_nearer = |&point: &u32| at(own).distance(at_other(point)) < distance;
            let earlier = *partner.entry(own).or_insert(other);
            if earlier != other || of_other.iter().any(is_nearer) {
                let found = format!("two for {} of face {a}; save the connectivity on vertices", at(own));
                return Err(connection.malformed("one point of the other zone for a point", found));
            }
            pairs.push([own as usize, other as usize]);
        }
    }
    Ok(pairs)
}

/// The points of a face in the order in which they are nearest to the points of another face.
fn nearest_way(face: &[u32], other: &[u32], at: impl Fn(u32) -> DVec3, at_other: impl Fn(u32) -> DVec3) -> Vec<u32> {
    let mut nearest = (f64::INFINITY, other.to_vec());
    let mut way = other.to_vec();
    for _ in 0..2 {
        way.reverse();
        for _ in 0..way.len() {
            way.rotate_left(1);
            let squares = face.iter().zip(&way).map(|(&a, &b)| at(a).distance_squared(at_other(b)));
            let sum: f64 = squares.sum();
            if sum < nearest.0 {
                nearest = (sum, way.clone());
            }
        }
    }
    nearest.1
}
