//! Signal compression: SVD, dynamic mode decomposition, self-organising maps and what they keep of the information.
