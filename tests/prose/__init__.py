"""Prose of documents and messages: the length of sentences, words that have better ones, and British spelling."""
