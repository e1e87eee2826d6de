//! relaxation
