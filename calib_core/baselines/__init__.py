"""The paper's other methods: by mounting (PMM), by checkerboard (CCM), and exchanges of their translations."""
