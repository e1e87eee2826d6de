//! The tree of a CGNS file: nodes with a name, a label, data and children.

use std::ops::Deref;

use hdf5_pure::Group;

use super::adf::{self, Adf};
use super::data::{Data, Source, Spot, Store};
use super::hdf5;
use super::headers::Header;
use crate::formats::error::ReadError;
use crate::formats::number::Integers;

/// A node in its kind of file.
enum Handle<'a> {
    Hdf5(Group),
    /// A node of ADF, with its place.
    Adf(&'a Adf, usize),
}

/// A node of the tree.
pub(super) struct Node<'a> {
    spot: Spot<'a>,
    handle: Handle<'a>,
}

impl<'a> Deref for Node<'a> {
    type Target = Spot<'a>;

    fn deref(&self) -> &Spot<'a> {
        &self.spot
    }
}

impl<'a> Node<'a> {
    /// The root of a file, which is in ADF or `hdf5`.
    pub fn root(
        source: &'a Source<'a>,
        adf: Option<&'a Adf>,
        hdf5: impl FnOnce() -> Result<Group, ReadError>,
    ) -> Result<Self, ReadError> {
        let handle = match adf {
            Some(adf) => Handle::Adf(adf, adf.root),
            None => Handle::Hdf5(hdf5()?),
        };
        Ok(Self { spot: Spot::root(source), handle })
    }

    /// The child with this name, if there is one.
    pub fn find(&self, name: &str) -> Option<Self> {
        let handle = match &self.handle {
            Handle::Hdf5(group) => Handle::Hdf5(group.group(name).ok()?),
            &Handle::Adf(adf, at) => {
                let children = adf.children(self, at).ok()?;
                Handle::Adf(adf, children.into_iter().find(|(found, _)| found == name)?.1)
            }
        };
        Some(self.below(name, handle))
    }

    fn below(&self, name: &str, handle: Handle<'a>) -> Self {
        Self { spot: self.spot.below(name), handle }
    }

    /// The child with this name.
    ///
    /// # Errors
    /// [`ReadError::Malformed`]: there is none.
    pub fn child(&self, name: &str) -> Result<Self, ReadError> {
        self.find(name).ok_or_else(|| self.malformed(format!("a node {name} in it"), "none"))
    }

    /// The children with this label, in the order of their names: HDF5 keeps no other order.
    pub fn children(&self, label: &str) -> Result<Vec<Self>, ReadError> {
        let labelled = self.labelled()?.into_iter().filter(|(found, _)| found == label);
        Ok(labelled.map(|(_, node)| node).collect())
    }

    /// All children with their labels, in the order of their names.
    pub fn labelled(&self) -> Result<Vec<(String, Self)>, ReadError> {
        let mut children: Vec<Self> = match &self.handle {
            Handle::Hdf5(group) => {
                let names = group.groups().map_err(|error| self.malformed("nodes of CGNS", error))?;
                names.iter().map(|name| self.child(name)).collect::<Result<_, _>>()?
            }
            &Handle::Adf(adf, at) => {
                let children = adf.children(self, at)?;
                children.into_iter().map(|(name, child)| self.below(&name, Handle::Adf(adf, child))).collect()
            }
        };
        children.sort_by(|a, b| a.path().cmp(b.path()));
        let mut labelled = Vec::with_capacity(children.len());
        for node in children {
            let (label, is_link) = match &node.handle {
                Handle::Hdf5(group) => hdf5::label(group).map_err(|error| node.malformed("a node of CGNS", error))?,
                Handle::Adf(_, at) => adf::label(&self.source.shared.bytes, *at),
            };
            if is_link {
                return Err(node.unsupported("a link to another node", "save the mesh as one file without links"));
            }
            labelled.push((label, node));
        }
        Ok(labelled)
    }

    /// The node's data.
    pub fn data(&self) -> Result<Data<'a>, ReadError> {
        match &self.handle {
            Handle::Hdf5(group) => hdf5::data(self, group),
            Handle::Adf(adf, at) => adf.data(self, *at),
        }
    }

    /// The header that says where the data are. `None` if its format is not known.
    pub fn header(&self) -> Option<Header> {
        let Handle::Hdf5(_) = self.handle else { return None };
        let names: Vec<&str> = self.path().split('/').skip(1).collect();
        hdf5::header(&self.source.shared.unread(), &names)
    }

    /// The data as whole numbers.
    pub fn integers(&self) -> Result<Integers<'a>, ReadError> {
        let Data { bytes, number, endian, store } = self.data()?;
        self.note(&store);
        // In a broken file many nodes may have the same bytes.
        self.source.allowance.take(&format!("the node {}", self.path()), bytes.len())?;
        Integers::stored(bytes, number, endian).ok_or_else(|| self.malformed("whole numbers", "others"))
    }

    /// The data as text.
    pub fn text(&self) -> Result<String, ReadError> {
        let Data { bytes, number, store, .. } = self.data()?;
        self.note(&store);
        if number.bytes() != 1 {
            return Err(self.malformed("text", "numbers"));
        }
        Ok(String::from_utf8_lossy(&bytes).trim_end_matches(['\0', ' ']).to_string())
    }

    /// Notes that data are read that are no coordinates.
    fn note(&self, store: &Store) {
        let Store::Pieces(pieces) = store else { return };
        for piece in pieces {
            // Two notes, so that these bytes are not taken for coordinates that are read whole.
            let middle = piece.start + piece.len() / 2;
            self.source.shared.note(piece.start..middle);
            self.source.shared.note(middle..piece.end);
        }
    }
}
