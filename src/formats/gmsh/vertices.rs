//! The `$Nodes` section as vertices with their tags.

use std::collections::HashMap;

use glam::DVec3;

use crate::formats::error::ReadError;
use crate::formats::scanner::Scanner;

/// The vertices in the order of the file.
pub(super) struct Vertices {
    /// Coordinates `[n_vertices]`, in the unit of the file.
    pub positions: Vec<DVec3>,
    /// Offset of each vertex's coordinates in the file `[n_vertices]`.
    pub slots: Vec<usize>,
    index: Index,
    /// Smallest and greatest tag.
    range: (u64, u64),
}

/// The vertex of each tag.
enum Index {
    /// A table of all tags from the smallest on, with [`NONE`] for unused tags.
    Dense(Vec<u32>),
    /// A hash map, for tags that are far apart.
    Sparse(HashMap<u64, u32>),
}

const NONE: u32 = u32::MAX;

/// If the range of tags is this many times larger than the number of vertices, a hash map is
/// smaller than the table.
const DENSE: u64 = 4;

/// Vertices while they are read.
pub(super) struct Builder {
    positions: Vec<DVec3>,
    slots: Vec<usize>,
    tags: Vec<u64>,
}

impl Builder {
    /// Reserves memory for `n_vertices`. The count was checked against the size of the file.
    pub fn new(n_vertices: usize) -> Self {
        Self {
            positions: Vec::with_capacity(n_vertices),
            slots: Vec::with_capacity(n_vertices),
            tags: Vec::with_capacity(n_vertices),
        }
    }

    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Reads the coordinates of the vertex with this tag.
    #[inline]
    pub fn read(&mut self, scanner: &mut Scanner, tag: u64) -> Result<(), ReadError> {
        self.slots.push(scanner.next_number());
        self.positions.push(scanner.coordinates(tag)?.into());
        self.tags.push(tag);
        Ok(())
    }

    /// Indexes the vertices by tag.
    pub fn finish(self, scanner: &Scanner) -> Result<Vertices, ReadError> {
        let Self { positions, slots, tags } = self;
        let limit = NONE as usize;
        if tags.len() >= limit {
            let path = scanner.path().into();
            return Err(ReadError::TooMany { path, what: "vertices", count: tags.len(), limit });
        }
        let range = (tags.iter().copied().min().unwrap_or(0), tags.iter().copied().max().unwrap_or(0));
        let duplicate =
            |vertex: usize| ReadError::DuplicateVertex { place: scanner.place(slots[vertex]), tag: tags[vertex] };
        let index = if range.1 - range.0 < DENSE * tags.len() as u64 {
            let mut table = vec![NONE; (range.1 - range.0) as usize + 1];
            for (vertex, tag) in tags.iter().enumerate() {
                let entry = &mut table[(tag - range.0) as usize];
                if *entry != NONE {
                    return Err(duplicate(vertex));
                }
                *entry = vertex as u32;
            }
            Index::Dense(table)
        } else {
            let mut map = HashMap::with_capacity(tags.len());
            for (vertex, &tag) in tags.iter().enumerate() {
                if map.insert(tag, vertex as u32).is_some() {
                    return Err(duplicate(vertex));
                }
            }
            Index::Sparse(map)
        };
        Ok(Vertices { positions, slots, index, range })
    }
}

impl Vertices {
    /// The vertex with this tag.
    #[inline]
    pub fn find(&self, tag: u64) -> Option<u32> {
        match &self.index {
            Index::Dense(table) => {
                let vertex = *table.get(usize::try_from(tag.checked_sub(self.range.0)?).ok()?)?;
                (vertex != NONE).then_some(vertex)
            }
            Index::Sparse(map) => map.get(&tag).copied(),
        }
    }

    /// Number of vertices and range of their tags, for messages:
    /// `90000 vertices with tags 1..=90000`.
    pub fn described(&self) -> String {
        match self.positions.len() {
            0 => "no vertices".to_string(),
            n_vertices => format!("{n_vertices} vertices with tags {}..={}", self.range.0, self.range.1),
        }
    }
}
