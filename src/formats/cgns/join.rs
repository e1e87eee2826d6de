//! Joins the zones of a file into one mesh.
//!
//! Zones meet where their 1-to-1 connectivity says so, and where their points are equal. A point
//! that could be either of two is refused.

use std::collections::HashMap;

use glam::DVec3;

use super::face_pairs::{Side, ZoneFaces, pairs_of_points};
use super::tree::Node;
use crate::formats::error::ReadError;
use crate::geometry::bounds;

/// Greatest distance of two points that a connectivity says are one, in parts of the size of all
/// zones. Files round coordinates to seven digits.
const APART: f64 = 1e-6;

/// The points of a zone.
pub(super) struct ZonePoints<'a> {
    pub base: &'a Node<'a>,
    pub zone: &'a Node<'a>,
    pub positions: Vec<DVec3>,
}

/// The vertices of all zones.
pub(super) struct Joined {
    pub positions: Vec<DVec3>,
    /// Vertex of each point of each zone.
    pub vertex_of: Vec<Vec<u32>>,
    /// Whether a vertex belongs to several zones `[n_vertices]`.
    pub is_shared: Vec<bool>,
}

/// A point with the coordinates of points of other zones.
struct Place {
    point: u32,
    /// Whether another vertex is at the same place.
    is_ambiguous: bool,
    /// Index of the last zone that has this vertex.
    joined_in: usize,
}

/// Points that are joined step by step.
struct Sets {
    /// A point of the same vertex, or the point itself, for each point.
    parents: Vec<u32>,
}

impl Sets {
    /// The first point of a vertex.
    fn first(&mut self, mut point: u32) -> u32 {
        while self.parents[point as usize] != point {
            let next = self.parents[point as usize];
            self.parents[point as usize] = self.parents[next as usize];
            point = next;
        }
        point
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

/// The bits of a position; 0 and -0 are equal.
fn bits(point: &DVec3) -> [u64; 3] {
    point.to_array().map(|value| (value + 0.0).to_bits())
}

/// Joins the points of all zones.
///
/// # Errors
/// - [`ReadError::Unsupported`]: zones that overlap or do not meet in points, a connectivity of an
///   unknown kind
/// - [`ReadError::Malformed`]: a point could be either of two, or is far from the point that it is
pub(super) fn join(zones: &[ZonePoints]) -> Result<Joined, ReadError> {
    let mut firsts = vec![0];
    for zone in zones {
        firsts.push(firsts[firsts.len() - 1] + zone.positions.len());
    }
    let positions: Vec<DVec3> = zones.iter().flat_map(|zone| zone.positions.iter().copied()).collect();
    let mut sets = Sets { parents: (0..positions.len() as u32).collect() };
    let mut is_connected = vec![false; positions.len()];
    let size = bounds(positions.iter().copied()).map_or(0.0, |[low, high]| (high - low).max_element());
    let mut faces = ZoneFaces::default();
    for index in 0..zones.len() {
        for (donor, node, pairs) in connections(zones, index, &mut faces, APART * size)? {
            for [own, other] in pairs {
                let [own, other] = [firsts[index] + own, firsts[donor] + other];
                let distance = positions[own].distance(positions[other]);
                if distance.is_nan() || distance > APART * size {
                    let found = format!("{} and {}", positions[own], positions[other]);
                    return Err(node.malformed("points of two zones at the same place", found));
                }
                sets.join(own as u32, other as u32);
                is_connected[own] = true;
                is_connected[other] = true;
            }
        }
    }
    join_equal(zones, &firsts, &positions, &is_connected, &mut sets)?;
    Ok(numbered(&firsts, &positions, &mut sets))
}

/// Joins points of different zones with equal coordinates.
fn join_equal(
    zones: &[ZonePoints],
    firsts: &[usize],
    positions: &[DVec3],
    is_connected: &[bool],
    sets: &mut Sets,
) -> Result<(), ReadError> {
    let mut places: HashMap<[u64; 3], Place> = HashMap::new();
    for (index, zone) in zones.iter().enumerate() {
        let of_zone = firsts[index]..firsts[index + 1];
        // Points whose places the connectivity has given to them.
        for point in of_zone.clone().filter(|&point| is_connected[point]) {
            if let Some(place) = places.get_mut(&bits(&positions[point]))
                && sets.first(place.point) == sets.first(point as u32)
            {
                place.joined_in = index;
            }
        }
        for point in of_zone.clone() {
            let Some(place) = places.get_mut(&bits(&positions[point])) else { continue };
            if sets.first(place.point) == sets.first(point as u32) {
                continue;
            }
            if place.is_ambiguous || place.joined_in == index {
                // The connectivity says which of the points it is.
                if is_connected[point] {
                    continue;
                }
                let found =
                    format!("two of them at {}; save the zones with their 1-to-1 connectivity", positions[point]);
                return Err(zone.zone.malformed("at most one point of a zone where zones meet", found));
            }
            place.joined_in = index;
            sets.join(place.point, point as u32);
        }
        for point in of_zone {
            let place = Place { point: point as u32, is_ambiguous: false, joined_in: usize::MAX };
            let place = places.entry(bits(&positions[point])).or_insert(place);
            place.is_ambiguous |= sets.first(place.point) != sets.first(point as u32);
        }
    }
    Ok(())
}

/// Numbers the vertices in the order of their first points.
fn numbered(firsts: &[usize], positions: &[DVec3], sets: &mut Sets) -> Joined {
    let mut joined = Joined { positions: Vec::new(), vertex_of: Vec::new(), is_shared: Vec::new() };
    let mut vertex_of = vec![0; positions.len()];
    for point in 0..positions.len() {
        let first = sets.first(point as u32) as usize;
        if first == point {
            vertex_of[point] = joined.positions.len() as u32;
            joined.positions.push(positions[point]);
            joined.is_shared.push(false);
        } else {
            vertex_of[point] = vertex_of[first];
            joined.is_shared[vertex_of[first] as usize] = true;
        }
    }
    joined.vertex_of = firsts.windows(2).map(|ends| vertex_of[ends[0]..ends[1]].to_vec()).collect();
    joined
}

/// A connection of a zone: the index of the other zone, the node, and the points that are one.
type Connection<'a> = (usize, Node<'a>, Vec<[usize; 2]>);

/// The hint of errors about zones that are not joined.
pub(super) const HOW_ZONES_MEET: &str =
    "mesh the zones so that they share points, and save them with 1-to-1 connectivity";

/// The connections of a zone. Without them, zones meet in equal points.
///
/// - `index`: the zone's
/// - `most`: greatest distance of points that are one
fn connections<'a>(
    zones: &'a [ZonePoints<'a>],
    index: usize,
    faces: &mut ZoneFaces<'a>,
    most: f64,
) -> Result<Vec<Connection<'a>>, ReadError> {
    let (of, hint) = (&zones[index], HOW_ZONES_MEET);
    let mut connections = Vec::new();
    for all in of.zone.children("ZoneGridConnectivity_t")? {
        for (label, node) in all.labelled()? {
            match &*label {
                "GridConnectivity_t" => {}
                "GridConnectivity1to1_t" | "OversetHoles_t" => {
                    return Err(node.unsupported(format!("a connectivity ({label}) of an unstructured zone"), hint));
                }
                _ => continue,
            }
            let kind = node.children("GridConnectivityType_t")?;
            let kind = kind.first().map_or_else(|| Ok("Overset".to_owned()), Node::text)?;
            if kind != "Abutting1to1" {
                return Err(node.unsupported(format!("a connectivity of type {kind}"), hint));
            }
            let location = node.children("GridLocation_t")?;
            let location = location.first().map_or_else(|| Ok("Vertex".to_owned()), Node::text)?;
            if is_periodic(&node)? {
                continue;
            }
            let name = node.text()?;
            let is_donor = |zone: &ZonePoints| match name.split_once('/') {
                Some((base, zone_name)) => zone.base.name() == base && zone.zone.name() == zone_name,
                None => zone.zone.name() == name && zone.base.path() == of.base.path(),
            };
            let donor = zones.iter().position(is_donor).ok_or_else(|| node.malformed("the name of a zone", &name))?;
            let pairs = match &*location {
                "Vertex" => {
                    let own = indices(&numbers(&node, "PointList", "PointRange")?, of.positions.len())?;
                    let other = numbers(&node, "PointListDonor", "PointRangeDonor")?;
                    let other = indices(&other, zones[donor].positions.len())?;
                    as_many(&node, "points", [own.len(), other.len()])?;
                    own.into_iter().zip(other).map(|(own, other)| [own, other]).collect()
                }
                "FaceCenter" => {
                    let side = |zone: usize, (node, numbers)| Side { zone, points: &zones[zone], node, numbers };
                    let own = side(index, numbers(&node, "PointList", "PointRange")?);
                    let other = side(donor, numbers(&node, "PointListDonor", "PointRangeDonor")?);
                    as_many(&node, "faces", [own.numbers.len(), other.numbers.len()])?;
                    faces.read(index, of)?;
                    faces.read(donor, &zones[donor])?;
                    pairs_of_points(&node, faces, [&own, &other], most)?
                }
                _ => return Err(node.unsupported(format!("a connectivity with the GridLocation {location}"), hint)),
            };
            connections.push((donor, node, pairs));
        }
    }
    Ok(connections)
}

/// Whether a connection is of a boundary and its shifted or rotated copy.
fn is_periodic(connection: &Node) -> Result<bool, ReadError> {
    for property in connection.children("GridConnectivityProperty_t")? {
        if !property.children("Periodic_t")?.is_empty() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Checks that a connection names as many points or faces of both zones.
fn as_many(connection: &Node, what: &str, [own, other]: [usize; 2]) -> Result<(), ReadError> {
    let found = || format!("{own} and {other}");
    if own == other { Ok(()) } else { Err(connection.malformed(format!("as many {what} in both zones"), found())) }
}

/// A node with numbers, and the numbers.
type Numbers<'a> = (Node<'a>, Vec<i64>);

/// Numbers of points or faces, from a list or a range.
fn numbers<'a>(connection: &Node<'a>, list: &str, range: &str) -> Result<Numbers<'a>, ReadError> {
    let node = connection.find(list).map_or_else(|| connection.child(range), Ok)?;
    let mut integers = node.integers()?;
    let mut numbers: Vec<i64> = (0..integers.len()).filter_map(|place| integers.get(place)).collect();
    if let (true, &[first, last]) = (node.name() == range, &numbers[..]) {
        if first > last || last.saturating_sub(first) > i64::from(u32::MAX) {
            return Err(node.malformed("a range that ascends", format_args!("{first} to {last}")));
        }
        numbers = (first..=last).collect();
    }
    Ok((node, numbers))
}

/// Indices of points from their numbers, which count from 1.
fn indices((node, numbers): &Numbers, count: usize) -> Result<Vec<usize>, ReadError> {
    let index = |&number: &i64| {
        let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        let index = index.filter(|&index| index < count);
        index.ok_or_else(|| node.malformed(format!("points, 1 to {count}"), number))
    };
    numbers.iter().map(index).collect()
}
