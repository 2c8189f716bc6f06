//! Revisions of the standard that a recording may follow.

/// Edition of the standard that a file follows (7.4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Revision {
    /// IEEE C37.111-1991, whose files do not name it.
    Of1991,
    /// IEEE C37.111-1999, or IEC 60255-24:2001.
    Of1999,
    /// IEEE C37.111-2013, or IEC 60255-24:2013.
    Of2013,
}
