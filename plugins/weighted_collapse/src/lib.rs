//! Weighted edge collapse of Qu and Huang (2015)
