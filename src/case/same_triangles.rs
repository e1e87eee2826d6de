//! Finds which points of a surface are which vertices of a family, by the triangles alone.
//!
//! A reading is a map from the vertices to the points that takes triangles to triangles. A surface
//! without symmetry has one, whatever the order of its points: a vertex of an irregular mesh is
//! told from all others by the triangles around it. A regular surface has several readings, and
//! each is found.

use std::collections::HashMap;

/// Rounds in which the triangles around a vertex are looked at. More rounds leave fewer candidates
/// for the first triangle.
const ROUNDS: usize = 4;

/// Most triangles that are walked through. A surface of a million triangles with 20 readings takes
/// as many.
const MOST: usize = 20_000_000;

/// No point or triangle.
const NONE: u32 = u32::MAX;

/// A surface of triangles between points from 0 on.
pub(super) struct Triangles<'a> {
    pub n_points: usize,
    pub corners: &'a [[u32; 3]],
}

/// One reading of a connected part of a family.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reading {
    /// The part of the surface that is read.
    part: u32,
    /// Vertices of the part, and their points.
    pub pairs: Vec<(u32, u32)>,
}

/// Why there are no readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unread {
    /// The triangles are not the same.
    Differ,
    /// There are too many readings.
    Regular,
}

/// All readings of each connected part of a family. Parts hang together by edges of two triangles.
///
/// # Errors
/// [`Unread`]
pub(super) fn readings(family: &Triangles, surface: &Triangles) -> Result<Vec<Vec<Reading>>, Unread> {
    if family.n_points != surface.n_points || family.corners.len() != surface.corners.len() {
        return Err(Unread::Differ);
    }
    let [family, surface] = [Net::new(family)?, Net::new(surface)?];
    let mut of_kind: HashMap<u64, Vec<u32>> = HashMap::new();
    for (triangle, &kind) in (0..).zip(&surface.kinds) {
        of_kind.entry(kind).or_default().push(triangle);
    }
    let mut firsts: Vec<Option<(usize, u32)>> = vec![None; family.n_parts];
    for (triangle, kind) in (0..).zip(&family.kinds) {
        let alike = of_kind.get(kind).ok_or(Unread::Differ)?.len();
        let first = &mut firsts[family.part[triangle as usize] as usize];
        *first = Some(first.map_or((alike, triangle), |first| first.min((alike, triangle))));
    }
    let mut walk = Walk::new(&family, &surface);
    let mut all = Vec::new();
    for (_, first) in firsts.into_iter().flatten() {
        let mut readings: Vec<Reading> = Vec::new();
        for &candidate in &of_kind[&family.kinds[first as usize]] {
            let part = surface.part[candidate as usize];
            let sizes = [family.sizes[family.part[first as usize] as usize], surface.sizes[part as usize]];
            if sizes[0] != sizes[1] {
                continue;
            }
            for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                if let Some(mut pairs) = walk.reading(first, candidate, order)? {
                    pairs.sort_unstable();
                    // A lone triangle is read once for each order of its corners.
                    readings.push(Reading { part, pairs });
                }
            }
        }
        if readings.is_empty() {
            return Err(Unread::Differ);
        }
        all.push(readings);
    }
    Ok(all)
}

/// The point of each vertex `[n_points]`, if one reading of each part together takes the family to
/// the whole surface.
pub(super) fn together(family: &Triangles, surface: &Triangles, readings: &[&Reading]) -> Option<Vec<u32>> {
    let mut point_of = vec![NONE; family.n_points];
    let mut vertex_of = vec![NONE; family.n_points];
    for &(vertex, point) in readings.iter().flat_map(|reading| &reading.pairs) {
        let (known, back) = (&mut point_of[vertex as usize], &mut vertex_of[point as usize]);
        if (*known != NONE && *known != point) || (*back != NONE && *back != vertex) {
            return None;
        }
        (*known, *back) = (point, vertex);
    }
    let mut parts: Vec<u32> = readings.iter().map(|reading| reading.part).collect();
    parts.sort_unstable();
    let is_whole = parts.windows(2).all(|pair| pair[0] != pair[1]) && !point_of.contains(&NONE);
    (is_whole && is_same(family, surface, &point_of)).then_some(point_of)
}

/// Whether a map from vertices to points takes the triangles of a family to those of a surface.
pub(super) fn is_same(family: &Triangles, surface: &Triangles, point_of: &[u32]) -> bool {
    let sorted = |mut corners: [u32; 3]| {
        corners.sort_unstable();
        corners
    };
    let mut mapped: Vec<[u32; 3]> =
        family.corners.iter().map(|corners| sorted(corners.map(|vertex| point_of[vertex as usize]))).collect();
    let mut of_surface: Vec<[u32; 3]> = surface.corners.iter().copied().map(sorted).collect();
    mapped.sort_unstable();
    of_surface.sort_unstable();
    mapped == of_surface
}

/// Triangles with their neighbours.
struct Net<'a> {
    corners: &'a [[u32; 3]],
    n_points: usize,
    /// The triangle beyond the edge opposite to each corner, [`NONE`] unless the edge has two
    /// triangles.
    beyond: Vec<[u32; 3]>,
    /// Number of triangles at each of these edges.
    at_edge: Vec<[u32; 3]>,
    /// A number for the triangles around each point, equal in equal surroundings.
    colours: Vec<u64>,
    /// The same for triangles.
    kinds: Vec<u64>,
    /// Part of each triangle, and number of triangles of each part.
    part: Vec<u32>,
    sizes: Vec<usize>,
    n_parts: usize,
}

impl<'a> Net<'a> {
    fn new(of: &Triangles<'a>) -> Result<Self, Unread> {
        let corners = of.corners;
        if corners.iter().any(|&[a, b, c]| a == b || b == c || c == a) {
            return Err(Unread::Differ);
        }
        let mut edges: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(2 * corners.len());
        let edge = |triangle: &[u32; 3], corner: usize| {
            let (one, other) = (triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]);
            (one.min(other), one.max(other))
        };
        for (index, triangle) in (0..).zip(corners) {
            (0..3).for_each(|corner| edges.entry(edge(triangle, corner)).or_default().push(index));
        }
        let mut beyond = Vec::with_capacity(corners.len());
        let mut at_edge = Vec::with_capacity(corners.len());
        for (index, triangle) in (0..).zip(corners) {
            let around = [0, 1, 2].map(|corner| &edges[&edge(triangle, corner)]);
            at_edge.push(around.map(|triangles| triangles.len() as u32));
            beyond.push(around.map(|triangles| match triangles[..] {
                [one, other] => one ^ other ^ index,
                _ => NONE,
            }));
        }
        let mut net = Self {
            corners,
            n_points: of.n_points,
            beyond,
            at_edge,
            colours: Vec::new(),
            kinds: Vec::new(),
            part: Vec::new(),
            sizes: Vec::new(),
            n_parts: 0,
        };
        net.colour(edges.keys());
        net.divide();
        Ok(net)
    }

    /// Colours points by their neighbours, round by round.
    fn colour<'e>(&mut self, edges: impl Iterator<Item = &'e (u32, u32)> + Clone) {
        let mut colours = vec![0u64; self.n_points];
        for triangle in self.corners {
            triangle.iter().for_each(|&point| colours[point as usize] += 1);
        }
        for _ in 0..ROUNDS {
            // A sum does not depend on the order of the neighbours.
            let mut next: Vec<u64> = colours.iter().map(|&colour| mixed(colour).wrapping_mul(3)).collect();
            for &(one, other) in edges.clone() {
                next[one as usize] = next[one as usize].wrapping_add(mixed(colours[other as usize]));
                next[other as usize] = next[other as usize].wrapping_add(mixed(colours[one as usize]));
            }
            colours = next;
        }
        let kind = |triangle: &[u32; 3]| {
            triangle.iter().fold(0u64, |sum, &point| sum.wrapping_add(mixed(colours[point as usize])))
        };
        self.kinds = self.corners.iter().map(kind).collect();
        self.colours = colours;
    }

    /// Divides the triangles into parts that hang together by edges of two triangles.
    fn divide(&mut self) {
        self.part = vec![NONE; self.corners.len()];
        for first in 0..self.corners.len() {
            if self.part[first] != NONE {
                continue;
            }
            let part = self.n_parts as u32;
            self.part[first] = part;
            let mut reached = vec![first as u32];
            let mut done = 0;
            while let Some(&triangle) = reached.get(done) {
                done += 1;
                for beyond in self.beyond[triangle as usize] {
                    if beyond != NONE && self.part[beyond as usize] == NONE {
                        self.part[beyond as usize] = part;
                        reached.push(beyond);
                    }
                }
            }
            self.sizes.push(reached.len());
            self.n_parts += 1;
        }
    }
}

/// Mixes the bits of a number (the finaliser of splitmix64).
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}

/// Walks through a part of a family and through the surface at once.
struct Walk<'n, 'a> {
    family: &'n Net<'a>,
    surface: &'n Net<'a>,
    point_of: Vec<u32>,
    vertex_of: Vec<u32>,
    /// Triangle of the surface for each triangle of the family.
    image: Vec<u32>,
    walked: usize,
}

impl<'n, 'a> Walk<'n, 'a> {
    fn new(family: &'n Net<'a>, surface: &'n Net<'a>) -> Self {
        let (n_points, n_triangles) = (family.n_points, family.corners.len());
        Self {
            family,
            surface,
            point_of: vec![NONE; n_points],
            vertex_of: vec![NONE; n_points],
            image: vec![NONE; n_triangles],
            walked: 0,
        }
    }

    /// The reading in which the corners of the triangle `first` are those of `candidate` in this
    /// order, if there is one.
    fn reading(&mut self, first: u32, candidate: u32, order: [usize; 3]) -> Result<Option<Vec<(u32, u32)>>, Unread> {
        let mut pairs = Vec::new();
        let mut reached = Vec::new();
        let corners = self.surface.corners[candidate as usize];
        let mut agrees = self.take(first, candidate, order.map(|corner| corners[corner]), &mut pairs, &mut reached);
        let mut done = 0;
        while agrees && let Some(&triangle) = reached.get(done) {
            done += 1;
            agrees = self.pass_edges(triangle, &mut pairs, &mut reached);
        }
        self.walked += reached.len();
        for &(vertex, point) in &pairs {
            (self.point_of[vertex as usize], self.vertex_of[point as usize]) = (NONE, NONE);
        }
        reached.iter().for_each(|&triangle| self.image[triangle as usize] = NONE);
        if self.walked > MOST {
            return Err(Unread::Regular);
        }
        Ok(agrees.then_some(pairs))
    }

    /// Goes on to the triangles beside a triangle. Returns whether the surface has the same there.
    fn pass_edges(&mut self, triangle: u32, pairs: &mut Vec<(u32, u32)>, reached: &mut Vec<u32>) -> bool {
        let (family, surface) = (self.family, self.surface);
        let image = self.image[triangle as usize];
        let vertices = family.corners[triangle as usize];
        for corner in 0..3 {
            let point = self.point_of[vertices[corner] as usize];
            let Some(opposite) = surface.corners[image as usize].iter().position(|&other| other == point) else {
                return false;
            };
            let beyond = family.beyond[triangle as usize][corner];
            let of_image = surface.beyond[image as usize][opposite];
            if family.at_edge[triangle as usize][corner] != surface.at_edge[image as usize][opposite] {
                return false;
            }
            // At an edge of one triangle there is nothing beyond, and at an edge of three or more
            // it is open which is which.
            if beyond == NONE || of_image == NONE {
                continue;
            }
            let of_beyond = family.corners[beyond as usize];
            let known = of_beyond.map(|vertex| {
                let is_common = vertices.contains(&vertex) && vertex != vertices[corner];
                if is_common { self.point_of[vertex as usize] } else { NONE }
            });
            let mut left = surface.corners[of_image as usize].into_iter().filter(|point| !known.contains(point));
            let (Some(last), None) = (left.next(), left.next()) else { return false };
            let points = known.map(|point| if point == NONE { last } else { point });
            if !self.take(beyond, of_image, points, pairs, reached) {
                return false;
            }
        }
        true
    }

    /// Notes that the vertices of a triangle have these points. Returns whether this agrees with
    /// what is known.
    fn take(
        &mut self,
        triangle: u32,
        image: u32,
        points: [u32; 3],
        pairs: &mut Vec<(u32, u32)>,
        reached: &mut Vec<u32>,
    ) -> bool {
        match self.image[triangle as usize] {
            NONE => {
                self.image[triangle as usize] = image;
                reached.push(triangle);
            }
            known => return known == image,
        }
        for (vertex, point) in self.family.corners[triangle as usize].into_iter().zip(points) {
            let (known, back) = (self.point_of[vertex as usize], self.vertex_of[point as usize]);
            if known == NONE && back == NONE {
                if self.family.colours[vertex as usize] != self.surface.colours[point as usize] {
                    return false;
                }
                (self.point_of[vertex as usize], self.vertex_of[point as usize]) = (point, vertex);
                pairs.push((vertex, point));
            } else if known != point || back != vertex {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(family: &[[u32; 3]], surface: &[[u32; 3]]) -> Result<Vec<usize>, Unread> {
        let of = |corners| Triangles {
            n_points: 1 + *<[[u32; 3]]>::as_flattened(corners).iter().max().unwrap() as usize,
            corners,
        };
        readings(&of(family), &of(surface)).map(|parts| parts.iter().map(Vec::len).collect())
    }

    /// A grid of squares, each cut in the same direction.
    fn grid(n: u32, m: u32) -> Vec<[u32; 3]> {
        let at = |i: u32, j: u32| i * (m + 1) + j;
        let squares = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        squares
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    /// The numbers of symmetries in closed form.
    #[test]
    fn every_reading_is_found() {
        // Each order of the corners of a triangle.
        assert_eq!(count(&[[0, 1, 2]], &[[0, 1, 2]]), Ok(vec![6]));
        // A square: half turn, and the mirrors at both diagonals.
        assert_eq!(count(&grid(1, 1), &grid(1, 1)), Ok(vec![4]));
        // Half a turn of a grid; a grid of as many squares both ways has its diagonals besides.
        assert_eq!(count(&grid(3, 5), &grid(3, 5)), Ok(vec![2]));
        assert_eq!(count(&grid(4, 4), &grid(4, 4)), Ok(vec![4]));
        // A tetrahedron's surface: all orders of four points.
        let tet = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        assert_eq!(count(&tet, &tet), Ok(vec![24]));
        // Two of them: each of the one may be each of the other.
        let two: Vec<_> = tet.into_iter().chain(tet.map(|corners| corners.map(|corner| corner + 4))).collect();
        assert_eq!(count(&two, &two), Ok(vec![48, 48]));
        assert_eq!(count(&grid(3, 5), &grid(5, 3)), Ok(vec![2]));
        assert_eq!(count(&grid(2, 6), &grid(3, 4)), Err(Unread::Differ));
        assert_eq!(count(&grid(1, 1), &[[0, 1, 2], [0, 1, 1]]), Err(Unread::Differ));
    }

    /// An irregular surface has one reading, in any order of its points and triangles.
    #[test]
    fn an_irregular_surface_is_read_in_any_order() {
        // A triangle cut in at 3, then at 4 and 5: no two points have the same neighbours.
        let family =
            [[0, 1, 3], [0, 3, 4], [0, 4, 2], [3, 2, 4], [1, 5, 3], [1, 2, 5], [3, 5, 6], [3, 6, 2], [5, 2, 6]];
        let point_of = [4, 6, 1, 0, 3, 5, 2];
        let mut surface = family.map(|corners| corners.map(|vertex: u32| point_of[vertex as usize]));
        surface.reverse();
        surface[3].rotate_left(1);
        let of = |corners| Triangles { n_points: 7, corners };
        let (family, surface) = (of(&family), of(&surface));
        let all = readings(&family, &surface).unwrap();
        assert_eq!(all.iter().map(Vec::len).collect::<Vec<_>>(), [1]);
        assert_eq!(together(&family, &surface, &[&all[0][0]]), Some(point_of.to_vec()));
    }
}
