//! Secret token that grants access to a view.

use std::fmt;

use data_encoding::HEXLOWER;
use subtle::ConstantTimeEq;

/// Fewest characters; a shorter token could be guessed.
const MIN_CHARACTERS: usize = 16;
const MAX_CHARACTERS: usize = 256;
/// Bytes of a generated token: 256 bits.
const RANDOM_BYTES: usize = 32;

/// A token: 16 to 256 letters, digits, `-` and `_`, which go into addresses and headers as
/// they are.
#[derive(Clone)]
pub struct Token(String);

/// Error of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TokenError {
    /// Token that could be guessed.
    #[error(
        "the token has {0} characters, which could be guessed; give at least {MIN_CHARACTERS}, \
         such as `openssl rand -hex 32` prints"
    )]
    TooShort(usize),
    /// Token that does not fit into a header.
    #[error("the token has {0} characters; give at most {MAX_CHARACTERS}")]
    TooLong(usize),
    /// Token that does not fit into an address.
    #[error("the token has other characters than letters, digits, `-` and `_`")]
    Characters,
    /// System without random numbers.
    #[error("the system gives no random numbers; give a token")]
    NoRandomness,
}

impl Token {
    /// Takes a token; white space around it is none of it.
    ///
    /// # Errors
    /// It is too short or too long, or has other characters.
    pub fn parse(text: &str) -> Result<Self, TokenError> {
        let text = text.trim();
        if !text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte)) {
            return Err(TokenError::Characters);
        }
        match text.len() {
            length @ ..MIN_CHARACTERS => Err(TokenError::TooShort(length)),
            MIN_CHARACTERS..=MAX_CHARACTERS => Ok(Self(text.to_owned())),
            length => Err(TokenError::TooLong(length)),
        }
    }

    /// Generates a token that nobody can guess.
    ///
    /// # Errors
    /// The system has no randomness.
    pub fn random() -> Result<Self, TokenError> {
        let mut bytes = [0; RANDOM_BYTES];
        getrandom::fill(&mut bytes).map_err(|_| TokenError::NoRandomness)?;
        Ok(Self(HEXLOWER.encode(&bytes)))
    }

    /// Compares a token with this one in constant time.
    pub(crate) fn is(&self, told: &str) -> bool {
        self.0.as_bytes().ct_eq(told.as_bytes()).into()
    }

    /// Returns the token, to be shown only to those who may look.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

/// Never into a log.
impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_could_be_guessed_or_does_not_fit_is_refused() {
        assert_eq!(Token::parse("short").unwrap_err(), TokenError::TooShort(5));
        assert_eq!(Token::parse(&"x".repeat(257)).unwrap_err(), TokenError::TooLong(257));
        assert_eq!(Token::parse("with space in the middle").unwrap_err(), TokenError::Characters);
        assert_eq!(Token::parse("ümläute-sind-keine-zeichen").unwrap_err(), TokenError::Characters);
        let token = Token::parse("0123456789abcdef\n").unwrap();
        assert!(token.is("0123456789abcdef"));
        for other in ["", "0123456789abcdeF", "0123456789abcde", "0123456789abcdef0"] {
            assert!(!token.is(other), "{other}");
        }
    }

    #[test]
    fn no_two_are_alike_and_none_is_told() {
        let (one, other) = (Token::random().unwrap(), Token::random().unwrap());
        assert_eq!(one.reveal().len(), 2 * RANDOM_BYTES);
        assert!(!one.is(other.reveal()));
        assert!(Token::parse(one.reveal()).is_ok());
        assert!(!format!("{one:?}").contains(one.reveal()));
    }
}
