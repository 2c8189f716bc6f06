//! Numbers of enums in the C ABI, in both directions.

/// Implements `code` and `from_code` of an enum by the numbers of its variants.
macro_rules! codes {
    ($name:ident { $($variant:ident),+ $(,)? }) => {
        impl $name {
            /// Returns the number in the C ABI.
            #[inline]
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// Finds the variant of a number in the C ABI; `None` for a number that none has.
            #[inline]
            pub fn from_code(code: impl Into<u32>) -> Option<Self> {
                let code = code.into();
                $(if code == Self::$variant as u32 {
                    return Some(Self::$variant);
                })+
                None
            }
        }
    };
}

pub(crate) use codes;
