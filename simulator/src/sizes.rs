//! Sizes at which another code path begins, as those of [`sparse::sizes`]: `docs/internals.md` holds both, and a test
//! compares them.

sparse::define_sizes! {
    PARALLEL: usize = 8_000, Bits, "threads_begin_at_a_number_of_force_elements",
        "force elements of a scene from which on threads share its particles: forces, explicit steps, the check for finite numbers",
        "with fewer, waking a thread takes longer than it saves; 16,512 springs take 1.9 ns a spring and step in one thread, 1.3 in two";
    BATCH: usize = 512, Bits, "runs_of_every_length_have_the_bits_of_pair_by_pair",
        "most elements of a batch of pair forces",
        "what is done once a batch costs some 50 ns, 0.1 ns an element; its forces, 12 kB, stay in the nearest cache";
    MIN_REPEATS: usize = 8, Bits, "runs_of_every_length_have_the_bits_of_pair_by_pair",
        "repeats of a pattern of pairs from which on they are a run, read and written without indices",
        "a shorter one does not fill a vector of AVX-512";
    MAX_PERIOD: usize = 4, Bits, "runs_of_every_length_have_the_bits_of_pair_by_pair",
        "longest pattern of pairs that is looked for",
        "the diagonals of a net alternate with period 2; each further length is another pass over the pairs when a scene is built";
    MAX_ADVANCE: u32 = 3, Bits, "runs_of_every_length_have_the_bits_of_pair_by_pair",
        "most particles by which a run advances at once; further on, another run begins",
        "at the end of a mesh's row, structural springs skip 1 particle and bend springs 2";
    LANES: usize = 8, Bits, "runs_of_every_length_have_the_bits_of_pair_by_pair",
        "elements of a run that are computed together; its last ones are filled up",
        "the longest vectors, those of AVX-512, hold 8 numbers";
    MAX_DENSE_GLOBAL_ROWS: usize = 8, Rounding, "the_global_matrix_is_dense_up_to_a_size",
        "rows up to which fast-mass-spring factorises a dense matrix",
        "it is one panel, with nothing to analyse; from 9 rows on a sparse one is as quick, on chains and nets alike";
    GROUP: usize = 8, Rounding, "all_group_and_panel_sizes_match_the_assignment",
        "springs of a local step that are projected together; the last group is filled up",
        "the longest vectors hold 8 numbers";
    WIDEST: usize = 8, Rounding, "all_group_and_panel_sizes_match_the_assignment",
        "most columns of a panel in the substitutions of fast-mass-spring",
        "8 columns of 4 coordinates are 8 registers of AVX2, and leave 8 for the rows";
}
