"""Public recordings and pairs of others, solved and compared with what their authors published."""
