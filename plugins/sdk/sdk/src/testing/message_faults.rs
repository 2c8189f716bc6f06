//! Seeded message faults: lost, cut, oversized, unknown, misassigned, doubled, out of order.

/// Default rarity of faults: one message in so many has one.
const DEFAULT_RARITY: usize = 4;

/// Variable of the environment that says how many steps a message matrix takes.
const STEPS_VARIABLE: &str = "BUSBAR_MATRIX_STEPS";

/// Returns how many steps a message matrix takes: `BUSBAR_MATRIX_STEPS`, or a sample of so
/// many where the environment says nothing.
///
/// # Panics
/// When the variable is no count.
pub fn matrix_steps(sample: u64) -> u64 {
    match std::env::var(STEPS_VARIABLE) {
        Err(_) => sample,
        Ok(text) => match text.parse() {
            Ok(steps) if steps > 0 => steps,
            _ => panic!("{STEPS_VARIABLE} is no count of steps: '{text}'"),
        },
    }
}

/// Fault of one message on its way to an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MessageFault {
    /// Message that does not arrive.
    Lost,
    /// Message that ends early, or whose length field exceeds its bytes.
    Cut,
    /// Message larger than the adapter takes.
    Oversized,
    /// Message of an unknown type, code or form.
    Unknown,
    /// Message that names another tag, request, unit, alias or session than its own.
    Misassigned,
    /// Message that arrives twice.
    Duplicated,
    /// Message that arrives after one that was sent later.
    Reordered,
}

impl MessageFault {
    /// All kinds of message faults.
    pub const ALL: [Self; 7] = [
        Self::Lost,
        Self::Cut,
        Self::Oversized,
        Self::Unknown,
        Self::Misassigned,
        Self::Duplicated,
        Self::Reordered,
    ];
}

/// Seeded source of message faults and of the random numbers that go with them. The same seed makes
/// the same faults on every machine and release (SplitMix64, Steele et al. 2014).
///
/// ```
/// use busbar_plugin_sdk::testing::{FaultGenerator, MessageFault};
///
/// let mut faults = FaultGenerator::new(7).with_kinds(&[MessageFault::Cut]).with_rarity(2);
/// for number in 0..1000_u16 {
///     let mut message = number.to_be_bytes().to_vec();
///     if faults.next_fault() == Some(MessageFault::Cut) {
///         faults.cut(&mut message);
///         assert!(message.len() < 2);
///     }
/// }
/// ```
#[derive(Clone, Debug)]
pub struct FaultGenerator {
    state: u64,
    kinds: Vec<MessageFault>,
    rarity: usize,
}

impl FaultGenerator {
    /// Creates a generator of all kinds of faults, in one message of four.
    pub fn new(seed: u64) -> Self {
        Self { state: seed, kinds: MessageFault::ALL.to_vec(), rarity: DEFAULT_RARITY }
    }

    /// Returns the generator with these kinds of faults alone.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn with_kinds(self, kinds: &[MessageFault]) -> Self {
        assert!(!kinds.is_empty(), "no kind of fault");
        Self { kinds: kinds.to_vec(), ..self }
    }

    /// Returns the generator with a fault in one message of so many.
    #[must_use]
    pub fn with_rarity(self, rarity: usize) -> Self {
        Self { rarity: rarity.max(1), ..self }
    }

    /// Returns the fault of the next message; most have none.
    pub fn next_fault(&mut self) -> Option<MessageFault> {
        if self.below(self.rarity) > 0 {
            return None;
        }
        let index = self.below(self.kinds.len());
        self.kinds.get(index).copied()
    }

    /// Returns a random number.
    pub fn number(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a random number below a limit; 0 where the limit is 0.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.number() % (limit.max(1) as u64)) as usize
    }

    /// Draws an event that has a chance of one in so many.
    pub fn one_in(&mut self, rarity: usize) -> bool {
        self.below(rarity) == 0
    }

    /// Cuts a message short, by a byte at least.
    pub fn cut(&mut self, message: &mut Vec<u8>) {
        let length = self.below(message.len());
        message.truncate(length);
    }

    /// Flips one bit of a message.
    pub fn flip_bit(&mut self, message: &mut [u8]) {
        let index = self.below(message.len());
        let bit = self.below(8);
        if let Some(byte) = message.get_mut(index) {
            *byte ^= 1 << bit;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_makes_the_same_faults_for_ever() {
        let mut faults = FaultGenerator::new(0);
        // Reference values of SplitMix64.
        assert_eq!(faults.number(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(faults.number(), 0x6E78_9E6A_A1B9_65F4);
        let of = |seed| {
            let mut faults = FaultGenerator::new(seed);
            (0..1000).map(|_| faults.next_fault()).collect::<Vec<_>>()
        };
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }

    #[test]
    fn all_kinds_come_as_often_as_wanted() {
        let mut faults = FaultGenerator::new(1);
        let made: Vec<_> = (0..7000).filter_map(|_| faults.next_fault()).collect();
        for kind in MessageFault::ALL {
            let count = made.iter().filter(|fault| **fault == kind).count();
            assert!((150..350).contains(&count), "{kind:?}: {count}");
        }
        let mut none = FaultGenerator::new(1).with_rarity(usize::MAX);
        assert!((0..1000).all(|_| none.next_fault().is_none()));
    }

    #[test]
    fn a_cut_message_is_shorter_and_an_empty_one_no_fault() {
        let mut faults = FaultGenerator::new(2);
        for length in 1..50 {
            let mut message = vec![0; length];
            faults.flip_bit(&mut message);
            assert_eq!(message.iter().map(|byte| byte.count_ones()).sum::<u32>(), 1);
            faults.cut(&mut message);
            assert!(message.len() < length);
        }
        let mut empty = Vec::new();
        faults.cut(&mut empty);
        faults.flip_bit(&mut empty);
        assert!(empty.is_empty());
    }
}
