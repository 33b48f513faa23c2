//! Compiling a plain function for every instruction set.

/// Makes a function that runs `$body`, an `#[inline(always)]` function, compiled for the instruction set asked for.
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $body:ident($($argument:ident: $type:ty),* $(,)?)) => {
        $(#[$doc])*
        pub(crate) fn $name(set: $crate::train::kernels::InstructionSet, $($argument: $type),*) {
            use $crate::train::kernels::InstructionSet;
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2($($argument: $type),*) {
                $body($($argument),*);
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq,avx512bw")]
            fn avx512($($argument: $type),*) {
                $body($($argument),*);
            }
            match set {
                // SAFETY: only instruction sets that are present are made.
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx512 => unsafe { avx512($($argument),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                InstructionSet::Avx2 => unsafe { avx2($($argument),*) },
                InstructionSet::Portable => $body($($argument),*),
            }
        }
    };
}
pub(super) use dispatch;
